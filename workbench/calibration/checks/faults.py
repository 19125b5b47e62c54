"""Named faults in the data of a fit: evidence, cause, and remedy."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.checks.hypothesis import Hypothesis
from workbench.calibration.checks.mistaken_data import UNITS
from workbench.calibration.checks.target_motion import TargetMotion, find_target_motion
from workbench.calibration.data.averaging import scatter_chi2, weighted_mean
from workbench.calibration.data.observations import Observation, RejectedObservation, positions, stated_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.model.fit_event import CrossValidatedPlacement, Fault
from workbench.model.stats import chi2_sf
from workbench.optics.image import extent_px
from workbench.optics.rows import axes_of, rays_of_rig

SUSPECT_P = 1e-3
"""P value below which the captures of a placement are searched for target motion."""
SATURATED_SHARE = 0.2
"""Share of saturated spots above which saturation is a fault."""
AGREE_SD = 10.0
"""Rejected spots within this many deviations of their median agree on one position."""
LEAST_TRAVEL = 0.05
"""Share of the image that at least one spot must move from its nearest standoff to infinity."""


def find_faults(fit: CalibrationFit, placements: Sequence[CrossValidatedPlacement]) -> tuple[Fault, ...]:
    """All faults of the data, the most basic first.

    Args:
        fit: the fit.
        placements: its cross-validation.
    """
    found = [*_never_lit(fit), *_by_hypothesis(fit, placements)]
    # Captures after a step of the target agree with one another as those of a reflection do.
    if not any(fault.name == "moved" for fault in found):
        found += _reflections(fit)
    return (*found, *_saturated(fit), *_all_far(fit))


def _by_hypothesis(fit: CalibrationFit, placements: Sequence[CrossValidatedPlacement]) -> Iterator[Fault]:
    hypotheses = explain_misfit(fit)
    wiring = [h for h in hypotheses if h.kind not in {"standoff", "tilted", "spot"}]
    for h in wiring:
        yield _wiring_fault(fit, h)
    motions = () if wiring else find_target_motion(fit, _suspects(fit, placements))
    for motion in motions:
        yield _motion_fault(fit, motion)
    of_placement = {"standoff": _standoff_fault, "tilted": _tilt_fault}
    for h in hypotheses:
        if h.kind in of_placement and h.subject[0] not in {m.placement for m in motions}:
            yield of_placement[h.kind](fit, h)


def _suspects(fit: CalibrationFit, placements: Sequence[CrossValidatedPlacement]) -> list[int]:
    """Placements whose captures disagree with one another or with their prediction by the others."""
    cells, noise = fit.cells, fit.rig.noise
    keys = {one.placement for one in placements if one.spots_p < SUSPECT_P}
    used = {s.source for s in fit.used}
    keys |= {s.placement for s in cells.captures if s.source not in used}
    keys |= {cells.members[n][0].placement for n in cells.inconsistent}
    chi2, free = defaultdict[str, float](float), Counter[str]()
    for members in cells.members:
        value, degrees = scatter_chi2(positions(members), cells.repeat_scale * stated_sd(members, noise))
        chi2[members[0].placement] += value
        free[members[0].placement] += degrees
    keys |= {key for key, count in free.items() if count and chi2_sf(chi2[key], count) < SUSPECT_P}
    return [index for index, info in enumerate(cells.placements) if info.key in keys]


def _wiring_fault(fit: CalibrationFit, h: Hypothesis) -> Fault:
    if h.kind == "lasers_swapped":
        a, b = (fit.rig.laser_ids[i] for i in h.subject)
        text = (
            f"lasers {a} and {b} are exchanged: the data fit with their spots exchanged."
            " Cause: exchanged plugs, or exchanged ids in the captures or the rig file."
            " Do: exchange the plugs (or laser_id), then capture or fit again"
        )
        return Fault(name="lasers_swapped", message=text)
    if h.kind == "transposed":
        text = (
            "u_px and v_px are exchanged: the data fit with the columns exchanged."
            " Do: exchange the names of the columns, then fit again"
        )
        return Fault(name="transposed", message=text)
    if h.kind == "unit":
        unit, factor = tuple(UNITS.items())[h.subject[0]]
        text = (
            f"the standoffs look like {unit}: multiplied by {factor:g} they agree with the rig file."
            " Do: state standoff_mm in millimetres, then fit again"
        )
        return Fault(name="unit", message=text)
    how, instead = {
        "mirrored": ("mirrored left to right", " or turned by 180 degrees"),
        "upside_down": ("mirrored top to bottom", " or turned by 180 degrees"),
        "turned": ("turned by 180 degrees", ""),
    }[h.kind]
    return Fault(
        name=h.kind,
        message=f"the image is {how}: the data fit with the image turned back. Cause: the camera's flip"
        f" setting, a camera that looks into a mirror{instead}, or wrong signs of all lasers in the rig file."
        " Do: switch the flip off, or correct the signs of the baselines, and capture again",
    )


def _standoff_fault(fit: CalibrationFit, h: Hypothesis) -> Fault:
    info = fit.cells.placements[h.subject[0]]
    fitted = float(np.asarray(h.state.problem.data.standoff_mm)[h.subject[0]])
    return Fault(
        name="standoff",
        placement=info.key,
        message=f"the captures at {info.standoff_mm:g} mm fit a standoff of {fitted:.4g} mm"
        f"{_digit_error(info.standoff_mm, fitted)}; no other cause explains them. Do: measure it and"
        " capture it again, or leave it out; in a captures file, correct standoff_mm",
    )


def _tilt_fault(fit: CalibrationFit, h: Hypothesis) -> Fault:
    index, slope = h.subject
    info, name = fit.cells.placements[index], fit.table.parameters[slope].name
    axis, expected_deg = ("vertical", info.yaw_deg) if name.endswith("slope_x") else ("horizontal", 0.0)
    return Fault(
        name="tilted",
        placement=info.key,
        message=f"the target at {info.standoff_mm:g} mm was turned by {_tilt_deg(h):+.1f} deg"
        f" about the {axis} (expected {expected_deg:g} +- {fit.rig.bench.tilt_sd_deg:g} deg). Do: set it"
        " square, then capture this standoff again or leave it out",
    )


def _tilt_deg(h: Hypothesis) -> float:
    """Fitted tilt of a hypothesis `tilted`."""
    _, slope = h.subject
    data = h.state.problem.data
    value = np.asarray(data.mean)[slope] + np.asarray(data.sd)[slope] * h.state.y[slope]
    return float(np.degrees(np.arctan(value)))


def _digit_error(stated_mm: float, fitted_mm: float) -> str:
    """Text for the most frequent typing errors: a digit too many or too few."""
    for factor, words in ((10.0, "a digit too many"), (0.1, "a digit too few")):
        if abs(stated_mm / fitted_mm / factor - 1) < 0.05:
            return f" ({words})"
    return ""


def _motion_fault(fit: CalibrationFit, motion: TargetMotion) -> Fault:
    info = fit.cells.placements[motion.placement]
    return Fault(
        name="moved",
        placement=info.key,
        message=f"the target at {info.standoff_mm:g} mm moved by {motion.step_mm:+.2g} mm after"
        f" {motion.before} of its {motion.captures} captures, between {motion.last_before} and"
        f" {motion.first_after}. Do: fix the target, then capture this standoff again or leave it out",
    )


def _reflections(fit: CalibrationFit) -> Iterator[Fault]:
    """Rejected spots of one laser and placement that agree on another position."""
    rejected = defaultdict(list)
    for r in fit.rejected:
        if isinstance(r, RejectedObservation) and r.observation.seen:
            rejected[r.observation.laser_id, r.observation.placement].append(r.observation)
    for (laser, placement), outliers in rejected.items():
        used = [s for s in fit.used if (s.laser_id, s.placement) == (laser, placement)]
        if _is_another_spot(fit, outliers, used):
            yield Fault(
                name="reflection",
                message=f"laser {laser} at {outliers[0].standoff_mm:g} mm: {len(outliers)} of its captures"
                " agree on a spot at a position that the fit excludes; they are not used. Cause: a"
                " reflection, or another laser switched on instead. Do: cover the reflecting surface, look at"
                " the frames listed as not used, and capture again",
            )


def _is_another_spot(
    fit: CalibrationFit, outliers: Sequence[Observation], used: Sequence[Observation]
) -> bool:
    """Whether outliers agree with one another in every measured coordinate, and not with the used repeats."""
    position = positions(outliers)
    count = np.isfinite(position).sum(axis=0)
    if not count.any() or (count == 1).any():
        return False
    seen = count > 0
    tolerance = AGREE_SD * fit.cells.repeat_scale * stated_sd(outliers, fit.rig.noise)[:, seen]
    median = np.nanmedian(position[:, seen], axis=0)
    distance = np.abs(position[:, seen] - median)
    if not (np.isnan(distance) | (distance < tolerance)).all():
        return False
    if not used:
        return True
    mean, _ = weighted_mean(positions(used), stated_sd(used, fit.rig.noise))
    return bool((np.abs(median - mean[seen]) > tolerance.max(axis=0)).any())


def _never_lit(fit: CalibrationFit) -> Iterator[Fault]:
    seen = {s.laser_id for s in fit.cells.captures}
    dark = Counter(
        r.observation.laser_id
        for r in fit.rejected
        if isinstance(r, RejectedObservation) and not r.observation.seen
    )
    for laser in fit.rig.laser_ids:
        if laser not in seen:
            evidence = f"no spot in its {dark[laser]} captures" if dark[laser] else "it has no captures"
            yield Fault(
                name="never_lit",
                message=f"laser {laser} was never seen: {evidence}. Do: check its supply, plug and shutter,"
                " and its id in the rig file",
            )


def _saturated(fit: CalibrationFit) -> Iterator[Fault]:
    clipped = Counter(s.standoff_mm for s in fit.used if s.saturated)
    if clipped.total() > SATURATED_SHARE * len(fit.used):
        where = ", ".join(f"{mm:g}" for mm in sorted(clipped))
        yield Fault(
            name="saturated",
            message=f"{clipped.total()} of {len(fit.used)} spots are saturated (at {where} mm); their centres"
            " are determined by their rims alone. Do: shorten the exposure or lower the gain until the peak"
            " stays below full scale",
        )


def _all_far(fit: CalibrationFit) -> Iterator[Fault]:
    travels = [_travel(fit, laser) for laser in range(len(fit.rig.lasers))]
    known = [travel for travel in travels if travel is not None]
    if known and max(known) < LEAST_TRAVEL:
        nearest = min(s.standoff_mm for s in fit.used)
        yield Fault(
            name="all_far",
            message=f"all standoffs are far: from {nearest:g} mm to infinity no spot moves by more than"
            f" {100 * max(known):.1f} % of the image, too little to separate lens, offset and pointing."
            " Do: add nearer standoffs, down to where the outermost spot leaves the image",
        )


def _travel(fit: CalibrationFit, laser: int) -> float | None:
    """Share of the image between a laser's nearest spot and its vanishing point; None below 2 standoffs."""
    cells, camera = fit.cells, fit.rig.camera
    (axis,) = axes_of(rays_of_rig(fit.rig)[[laser]])
    measured = np.isfinite(cells.position_px)
    own = np.flatnonzero((cells.laser == laser) & measured[:, np.abs(axis).argmax()])
    standoff = np.array([cells.placements[n].standoff_mm for n in cells.placement[own]])
    if len(np.unique(standoff)) < 2:
        return None
    near = own[np.argmin(standoff)]
    (infinity,) = fit.curves.spots(np.array([laser]), np.zeros(1))
    moved = np.where(measured[near], cells.position_px[near] - fit.residual_px[near] - infinity, 0.0)
    return float(abs(moved @ axis) / extent_px(axis, (camera.width_px, camera.height_px)))
