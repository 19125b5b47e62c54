"""What is wrong with a fit's data, by name: cause, and what to do."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from workbench.calibration.checks.cross_validation import LeftOut
from workbench.calibration.checks.hypotheses import Hypothesis, explain_misfit
from workbench.calibration.checks.target_motion import TargetMotion, find_target_motion
from workbench.calibration.data.averaging import scatter_chi2, weighted_mean
from workbench.calibration.data.observations import Observation, positions, stated_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.model.fit_event import Fault
from workbench.model.stats import chi2_sf

REFUSING = ("lasers_swapped", "mirrored", "upside_down", "turned", "standoff", "moved", "never_lit")
"""With any other the calibration may still be what it says of itself."""
SUSPECT = 1e-3
"""Captures of a placement less likely than this are looked at one by one."""
SATURATED_SHARE = 0.2
LEAST_TRAVEL = 0.05
"""Of the picture: spots that all move less from the nearest standoff to infinity were seen from afar only."""


def refuses(fault: Fault) -> bool:
    """Whether no calibration can come of data with this fault."""
    return fault.name in REFUSING


def find_faults(fit: CalibrationFit, left_out: Sequence[LeftOut]) -> tuple[Fault, ...]:
    """Everything that can be named, in the order in which to look at it."""
    found = [*_never_lit(fit), *_by_hypothesis(fit, left_out)]
    if not any(fault.name == "moved" for fault in found):  # its captures agree with one another as well
        found += _reflections(fit)
    return (*found, *_saturated(fit), *_all_far(fit))


def _by_hypothesis(fit: CalibrationFit, left_out: Sequence[LeftOut]) -> Iterator[Fault]:
    hypotheses = explain_misfit(fit)
    wiring = [h for h in hypotheses if h.kind not in {"standoff", "spot"}]
    for h in wiring:
        yield _name_wiring(fit, h)
    movements = () if wiring else find_target_motion(fit, _suspects(fit, left_out))
    for movement in movements:
        yield _name_movement(fit, movement)
    for h in hypotheses:
        if h.kind == "standoff" and h.subject[0] not in {m.placement for m in movements}:
            yield _name_standoff(fit, h)


def _suspects(fit: CalibrationFit, left_out: Sequence[LeftOut]) -> list[int]:
    """Placements whose captures disagree with one another or with what the others say of them."""
    cells, noise = fit.cells, fit.rig.noise
    odd = {one.placement for one in left_out if one.spots_p < SUSPECT}
    used = {s.source for s in fit.used}
    odd |= {s.placement for s in cells.captures if s.source not in used}
    odd |= {cells.members[n][0].placement for n in cells.torn}
    chi2, free = defaultdict[str, float](float), Counter[str]()
    for members in cells.members:
        apart, degrees = scatter_chi2(positions(members), cells.repeat_scale * stated_sd(members, noise))
        chi2[members[0].placement] += apart
        free[members[0].placement] += degrees
    odd |= {key for key, count in free.items() if count and chi2_sf(chi2[key], count) < SUSPECT}
    return [index for index, info in enumerate(cells.placements) if info.key in odd]


def _name_wiring(fit: CalibrationFit, h: Hypothesis) -> Fault:
    if h.kind == "lasers_swapped":
        a, b = (fit.rig.laser_ids[i] for i in h.subject)
        text = (
            f"lasers {a} and {b} are exchanged: with the spots of one taken for the other's everything fits."
            " Cause: wired the wrong way round, or their ids exchanged in the captures or the rig file."
            " Do: exchange the plugs (or laser_id) and capture or fit again"
        )
        return Fault(name="lasers_swapped", message=text)
    how, instead = {
        "mirrored": ("mirrored left to right", " or turned by 180 degrees"),
        "upside_down": ("mirrored top to bottom", " or turned by 180 degrees"),
        "turned": ("turned by 180 degrees", ""),
    }[h.kind]
    return Fault(
        name=h.kind,
        message=f"the picture is {how}: turned back, everything fits. Cause: the camera's flip setting,"
        f" a camera mounted by way of a mirror{instead}, or every laser's sign wrong in the rig file. Do:"
        " switch the flip off, or correct the baselines' signs, and capture again",
    )


def _name_standoff(fit: CalibrationFit, h: Hypothesis) -> Fault:
    info = fit.cells.placements[h.subject[0]]
    fitted = float(np.asarray(h.state.problem.data.standoff_mm)[h.subject[0]])
    slip = _slip(info.standoff_mm, fitted)
    return Fault(
        name="standoff",
        message=f"the captures at {info.standoff_mm:g} mm fit a standoff of {fitted:.4g} mm, and nothing else"
        f" explains them{slip}. Do: correct the standoff where it was written down, or leave it out"
        f" (--without-standoff {info.standoff_mm:g})",
    )


def _slip(told_mm: float, fitted_mm: float) -> str:
    """The commonest mistypings."""
    for factor, words in ((10.0, "a digit too many"), (0.1, "a digit too few")):
        if abs(told_mm / fitted_mm / factor - 1) < 0.05:
            return f": {words}"
    return ""


def _name_movement(fit: CalibrationFit, movement: TargetMotion) -> Fault:
    info = fit.cells.placements[movement.placement]
    return Fault(
        name="moved",
        message=f"the target at {info.standoff_mm:g} mm moved by {movement.step_mm:+.2g} mm after"
        f" {movement.before}"
        f" of its {movement.captures} captures, between {movement.last_before} and {movement.first_after}."
        f" Do: fix the target, and capture that standoff again or leave it out (--without-standoff"
        f" {info.standoff_mm:g})",
    )


def _reflections(fit: CalibrationFit) -> Iterator[Fault]:
    """Spots that were rejected and agree with one another: something shines there."""
    away = defaultdict(list)
    for r in fit.rejected:
        if r.stray is not None:
            away[r.stray.laser_id, r.stray.placement].append(r.stray)
    for (laser, placement), strays in away.items():
        used = [s for s in fit.used if (s.laser_id, s.placement) == (laser, placement)]
        if _is_another_spot(fit, strays, used):
            yield Fault(
                name="reflection",
                message=f"laser {laser} at {strays[0].standoff_mm:g} mm: {len(strays)} of its captures"
                f" agree on a"
                " spot where it cannot be; they are left out. Cause: a reflection, or another laser lit in"
                " its place. Do: cover what shines, look at the frames listed as not used, and capture again",
            )


def _is_another_spot(fit: CalibrationFit, strays: Sequence[Observation], used: Sequence[Observation]) -> bool:
    """Whether strays agree, in each coordinate that they have, and not with the repeats that are used."""
    position = positions(strays)
    count = np.isfinite(position).sum(axis=0)
    if not count.any() or (count == 1).any():  # one alone agrees with nothing
        return False
    seen = count > 0
    wide = 10 * fit.cells.repeat_scale * stated_sd(strays, fit.rig.noise)[:, seen]
    middle = np.nanmedian(position[:, seen], axis=0)
    apart = np.abs(position[:, seen] - middle)
    if not (np.isnan(apart) | (apart < wide)).all():
        return False
    if not used:
        return True
    rest, _ = weighted_mean(positions(used), stated_sd(used, fit.rig.noise))
    return bool((np.abs(middle - rest[seen]) > wide.max(axis=0)).any())


def _never_lit(fit: CalibrationFit) -> Iterator[Fault]:
    seen = {s.laser_id for s in fit.cells.captures}
    dark = Counter(r.missing.laser_id for r in fit.rejected if r.missing is not None)
    for laser in fit.rig.laser_ids:
        if laser not in seen:
            shown = (
                f"none of its {dark[laser]} captures shows a spot" if dark[laser] else "no capture is of it"
            )
            yield Fault(
                name="never_lit",
                message=f"laser {laser} never lit: {shown}. Do: check its supply, its plug and its"
                f" shutter, and that"
                " its id is that of the rig file",
            )


def _saturated(fit: CalibrationFit) -> Iterator[Fault]:
    clipped = Counter(s.standoff_mm for s in fit.used if s.saturated)
    if clipped.total() > SATURATED_SHARE * len(fit.used):
        where = ", ".join(f"{mm:g}" for mm in sorted(clipped))
        yield Fault(
            name="saturated",
            message=f"{clipped.total()} of {len(fit.used)} spots are saturated (at {where} mm): their"
            f" centres rest"
            " on the"
            " rim alone. Do: shorten the exposure or lower the gain until the peak stays below full scale",
        )


def _all_far(fit: CalibrationFit) -> Iterator[Fault]:
    reaches = [_reach(fit, laser) for laser in range(len(fit.rig.lasers))]
    known = [reach for reach in reaches if reach is not None]
    if known and max(known) < LEAST_TRAVEL:
        nearest = min(p.standoff_mm for p in fit.cells.placements)
        yield Fault(
            name="all_far",
            message=f"all standoffs are far: from {nearest:g} mm on no spot moves by more than"
            f" {100 * max(known):.1f} % of the picture, too little to tell lens, offset and pointing apart."
            " Do: add standoffs nearer to the sensor, down to where the outermost spot leaves the picture",
        )


def _reach(fit: CalibrationFit, laser: int) -> float | None:
    """Share of the picture from a laser's nearest spot to where it ends at infinity; None if hardly seen."""
    cells, camera = fit.cells, fit.rig.camera
    axis = "uv".index(fit.rig.lasers[laser].axis)
    mine = np.flatnonzero((cells.laser == laser) & np.isfinite(cells.position_px[:, axis]))
    standoff = np.array([cells.placements[n].standoff_mm for n in cells.placement[mine]])
    if len(np.unique(standoff)) < 2:
        return None
    near = mine[np.argmin(standoff)]
    infinity = fit.curves.spots(np.array([laser]), np.zeros(1))[0, axis]
    away = cells.position_px[near, axis] - fit.residual_px[near, axis] - infinity
    return float(abs(away) / (camera.width_px, camera.height_px)[axis])
