"""Assessment of a fit against limits: verdict, reasons, warnings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.calibration.checks.cross_validation import alarms
from workbench.calibration.checks.faults import find_faults
from workbench.calibration.checks.mistaken_data import undecided_unit
from workbench.calibration.checks.priors import contradicted_priors, doubted_priors
from workbench.calibration.checks.residuals import alarms as residual_alarms
from workbench.calibration.checks.residuals import explain, residual_tests
from workbench.calibration.checks.settling import BY_ORDER, drift_advice
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.model.parameters import DRIFT, fits_drift
from workbench.calibration.selection.drift import SHOWN_P, drift_test
from workbench.calibration.verdict.observability import NullDirection, direction_lines
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import FloatArray
from workbench.model.calibration import DeterminedBy
from workbench.model.fit_event import CrossValidatedPlacement, Fault, ResidualTest
from workbench.model.number_text import counted
from workbench.model.stats import chi2_isf
from workbench.optics.rows import axes_of, rays_of_rig

WARNED_P = 0.01
"""P value of the placement errors below which their scatter is a warning."""
LARGEST_HIDDEN_PX = 0.2
"""Drift that a session must be able to show; otherwise its order of captures is a note."""
SPECKLE_SCALE = 1.5
"""Noise scale from which a missing speckle_sd_px is named as the cause."""
DATA_SHARE_DETERMINED = 0.9
"""Information share of the data from which a parameter is determined by them."""
PRIOR_UNMOVED = 0.9
"""Ratio of posterior to prior sd above which neither data nor other priors constrain the parameter."""


@dataclass(frozen=True)
class Derived:
    """Quantities of a laser that the data determine under any priors. 1 sigma."""

    laser_id: str
    f_b_px_mm: float
    """Focal length times baseline (distance of the laser from the pinhole, positive on either side)."""
    f_b_sd: float
    infinity_px: float
    """Vanishing point: the spot of a target at infinity, along the laser's axis."""
    infinity_sd: float


@dataclass(frozen=True)
class Assessment:
    """Verdict on a fit, with its evidence."""

    verdict: Literal["accepted", "refused"]
    reasons: tuple[str, ...]
    """Reasons of a refusal; empty when accepted."""
    warnings: tuple[str, ...]
    cross_validation: tuple[CrossValidatedPlacement, ...] = ()
    faults: tuple[Fault, ...] = ()
    residual_tests: tuple[ResidualTest, ...] = ()
    directions: tuple[NullDirection, ...] = ()
    needs_standoffs: bool = False
    """See `FitFinished.needs_standoffs`."""


def determined_by(fit: CalibrationFit) -> tuple[DeterminedBy, ...]:
    """`basis` of each parameter, (P,)."""
    columns = zip(fit.data_share.tolist(), fit.sd.tolist(), fit.table.prior_sd.tolist(), strict=True)
    return tuple(basis(share, sd, prior_sd) for share, sd, prior_sd in columns)


def basis(data_share: float, sd: float, prior_sd: float) -> DeterminedBy:
    """Source of the information on a parameter.

    `data`: the data alone. `prior`: its own prior, hardly narrowed. `joint`: the data together with the
    priors of other parameters.
    """
    if data_share >= DATA_SHARE_DETERMINED:
        return "data"
    return "prior" if prior_sd == 0 or sd > PRIOR_UNMOVED * prior_sd else "joint"


def derive(fit: CalibrationFit) -> tuple[Derived, ...]:
    """`Derived` of every laser, with standard deviations from the full covariance."""
    return tuple(_derive_one(fit, index) for index in range(len(fit.rig.lasers)))


def assess(
    fit: CalibrationFit,
    limits: Acceptance,
    max_relative_range_sd: float,
    placements: Sequence[CrossValidatedPlacement],
    directions: Sequence[NullDirection] = (),
) -> Assessment:
    """Compare a fit with the limits, and run all its checks.

    Where a fault refuses the fit, its consequences (contradicted priors, alarms, missed limits) are not
    listed.

    Args:
        fit: the fit.
        limits: limits of the calibration.
        max_relative_range_sd: as in the calibration's `validity`.
        placements: cross-validation of the fit.
        directions: null directions, for the warnings.
    """
    reasons = _too_few_standoffs(fit, limits)
    needs_standoffs = bool(reasons) or not max_relative_range_sd <= limits.max_relative_range_sd
    if not fit.converged:
        reasons.append("the solver did not converge. Do: check the standoffs and the laser ids")
    faults = find_faults(fit, placements)
    tests = residual_tests(fit)
    refusing = [fault.message for fault in faults if fault.refuses]
    warnings = [fault.message for fault in faults if not fault.refuses]
    if refusing:
        reasons = [*refusing, *reasons]
    else:
        warnings = [*_unit_warning(fit), *direction_lines(directions), *warnings, *_warnings(fit)]
        reasons += [
            *contradicted_priors(fit),
            *map(_alarm, alarms(placements)),
            *_missed_limits(fit, limits, max_relative_range_sd),
        ]
        warnings += [explain(test) for test in residual_alarms(tests)]
    return Assessment(
        verdict="refused" if reasons else "accepted",
        reasons=tuple(reasons),
        warnings=tuple(warnings),
        cross_validation=tuple(placements),
        faults=faults,
        residual_tests=tests,
        directions=tuple(directions),
        needs_standoffs=needs_standoffs and not refusing,
    )


def _missed_limits(fit: CalibrationFit, limits: Acceptance, max_relative_range_sd: float) -> list[str]:
    reasons = []
    if not np.abs(fit.drift_px).max() <= limits.max_drift_px:
        reasons.append(
            f"the image drifted by {_drift_text(fit)}, expected at most"
            f" {limits.max_drift_px:g} px. {drift_advice(fit)}, and capture again"
        )
    if not fit.placement_scale <= limits.max_placement_scale:
        reasons.append(
            f"placements scatter {fit.placement_scale:.1f} times more than stated"
            f" ({fit.rig.bench.placement_sd_mm:g} mm), expected at most {limits.max_placement_scale:g} times."
            " Do: check the ruler and the stop, and capture again"
        )
    if not fit.rms_px <= limits.max_rms_px:
        reasons.append(
            f"residual rms {fit.rms_px:.2f} px, expected at most {limits.max_rms_px:g} px. Do: capture the"
            f" spot with the largest residual again ({_largest_residual(fit)})"
        )
    if not max_relative_range_sd <= limits.max_relative_range_sd:
        reasons.append(
            f"relative standard deviation of ranges up to {100 * max_relative_range_sd:.2g} %,"
            f" expected at most {100 * limits.max_relative_range_sd:g} %. Do: add standoffs (workbench design"
            " proposes them) or repeats"
        )
    return reasons


def _derive_one(fit: CalibrationFit, index: int) -> Derived:
    laser = fit.rig.lasers[index]
    start = fit.layout.ray(index).start
    origin = slice(start, start + 2)

    baseline = float(np.hypot(*fit.values[origin]))
    product = np.zeros(len(fit.values))
    product[0] = baseline
    product[origin] = fit.values[0] * fit.values[origin] / baseline

    this, infinity = np.array([index]), np.zeros(1)
    (axis,) = axes_of(rays_of_rig(fit.rig)[[index]])
    own = fit.layout.own(index)
    vanishing = np.zeros(len(fit.values))
    vanishing[own] = axis @ fit.curves.gradients(this, infinity)[0, :, : len(own)]
    return Derived(
        laser_id=laser.id,
        f_b_px_mm=float(fit.values[0]) * baseline,
        f_b_sd=_sd(fit, product),
        infinity_px=float(axis @ fit.curves.spots(this, infinity)[0]),
        infinity_sd=_sd(fit, vanishing),
    )


def _sd(fit: CalibrationFit, gradient: FloatArray) -> float:
    return float(np.sqrt(gradient @ fit.covariance @ gradient))


def _too_few_standoffs(fit: CalibrationFit, limits: Acceptance) -> list[str]:
    seen: dict[str, set[float]] = defaultdict(set)
    captured = {s.laser_id for s in fit.cells.captures}
    for s in fit.used:
        seen[s.laser_id].add(s.standoff_mm)
    return [
        f"laser {i} was seen at {counted(len(seen[i]), 'standoff')}, expected at least"
        f" {limits.min_standoffs}. Do: capture it at more standoffs"
        for i in fit.rig.laser_ids
        if len(seen[i]) < limits.min_standoffs and (seen[i] or i in captured)  # else the fault never_lit
    ]


def _alarm(one: CrossValidatedPlacement) -> str:
    if one.alarm_test == "range":
        error = "beyond infinity" if one.error_mm is None else f"{one.error_mm:+.2f} mm"
        evidence = f"range error {error}, expected 0 +- {one.sd_mm:.2g} mm (1 sigma)"
    else:
        evidence = f"chi2 of the spots {one.chi2:.0f}, expected {one.coordinates}"
    return (
        f"the captures at {one.standoff_mm:g} mm contradict the others: {evidence}, by the fit without them."
        f" Do: check this standoff and its captures, or leave it out"
    )


def _hidden_drift_px(fit: CalibrationFit) -> float:
    """Drift that half of the sessions would not show, along the axes that the data constrain; 0 without any.

    Infinite where the parts of the session are too short to show any.

    The test of K shifts shows one of them where its square, in standard deviations, has a chi-square of K
    degrees of freedom beyond the test's threshold.
    """
    sd_px = drift_test(fit).sd_px
    drift_sd_px = sd_px[: len(DRIFT)]
    if fit.layout.parts > 1 and not np.isfinite(drift_sd_px).any():
        return float("inf")  # the steps between the parts take up any drift
    noticed_sd = float(chi2_isf(SHOWN_P, len(sd_px))) ** 0.5
    return float(noticed_sd * drift_sd_px[np.isfinite(drift_sd_px)].max(initial=0.0))


def _hidden_text(hidden_px: float) -> str:
    return f"up to {hidden_px:.2g} px" if np.isfinite(hidden_px) else "any size"


def _by_order(fit: CalibrationFit) -> str:
    """Remark on a drift by the order of the captures; empty where they have times."""
    return "" if np.isfinite(fit.cells.times.duration_s) else BY_ORDER


def _drift_text(fit: CalibrationFit) -> str:
    u, v = fit.drift_px
    parts = fit.layout.parts
    when = "from the first capture to the last" if parts == 1 else f"over {parts} parts of the session"
    return f"{u:+.2f} px in u and {v:+.2f} px in v {when}"


def _largest_residual(fit: CalibrationFit) -> str:
    size = np.abs(fit.residual_px / fit.cells.sd_px)
    cell, axis = np.unravel_index(np.nanargmax(size), size.shape)
    laser = fit.rig.laser_ids[fit.cells.laser[cell]]
    standoff = fit.cells.placements[fit.cells.placement[cell]].standoff_mm
    return f"{fit.residual_px[cell, axis]:+.2f} px in {'uv'[axis]} of laser {laser} at {standoff:g} mm"


def _unit_warning(fit: CalibrationFit) -> list[str]:
    """Doubt of the unit of all standoffs, where the priors do not decide."""
    if (unit := undecided_unit(fit)) is None:
        return []
    nearest, farthest = (f"{limit(s.standoff_mm for s in fit.used):g}" for limit in (min, max))
    return [
        f"the standoffs ({nearest} to {farthest} mm) may be {unit}: by the rig file's priors that is about as"
        " probable. Do: check the unit of standoff_mm; a measured baseline decides."
    ]


def _warnings(fit: CalibrationFit) -> list[str]:
    sensor = [(p, by) for p, by in zip(fit.table.parameters, determined_by(fit), strict=True) if p.prior.sd]
    prior = [p.name for p, by in sensor if by == "prior" and p.kind == "sensor"]
    warnings = doubted_priors(fit)
    if prior:
        are, priors = ("is", "prior is") if len(prior) == 1 else ("are", "priors are")
        warnings.append(
            f"{', '.join(prior)} {are} not constrained by these captures; the rig file's {priors} used."
        )
    warnings += [
        f"the data call for {term.name} (p {term.p_value:.1g}), which the rig file holds constant."
        " Give it an sd in the rig file."
        for term in fit.terms
        if term.verdict == "called for"
    ]
    if fit.cells.repeat_scale > 1:
        warnings.append(
            f"repeats scatter {fit.cells.repeat_scale:.2f} times more than the stated noise of the spots;"
            " their sd is scaled by this factor."
        )
    if fit.placement_scatter_p < WARNED_P:
        warnings.append(
            f"placements scatter {fit.placement_scale:.1f} times more than stated"
            f" (bench.placement_sd_mm {fit.rig.bench.placement_sd_mm:g}); their sd is scaled by this factor."
        )
    hidden = 0.0 if fits_drift(fit.rig) else _hidden_drift_px(fit)
    if hidden > LARGEST_HIDDEN_PX:
        warnings.append(
            f"a drift of the image of {_hidden_text(hidden)} during the session would look like an effect of"
            f" the standoff, and would not be noticed (at most {LARGEST_HIDDEN_PX:g} px is expected)."
            f"{_by_order(fit)} Do: visit the standoffs in shuffled order (order: shuffled), and return to two"
            " of them at the end (returns: 2)."
        )
    if np.any(fit.drift_px):
        warnings.append(
            f"the image drifted by {_drift_text(fit)}; the fit allows for it, and the sd of the image centre"
            f" includes half the drift. {drift_advice(fit)}."
        )
    if fit.noise_scale > 1:
        warnings.append(
            f"residuals are {fit.noise_scale:.2f} times larger than the stated noise of the spots"
            f" (chi2 {fit.chi2:.1f} for {fit.degrees_of_freedom:.1f} degrees of freedom);"
            f" every sd is scaled by this factor. The largest residual is {_largest_residual(fit)}."
        )
    if fit.noise_scale > SPECKLE_SCALE and not fit.cells.speckle_sd_px.any():
        warnings.append(
            "the rig file has no value for speckle (noise.speckle_sd_px). Speckle is the same in all repeats,"
            " so their scatter does not show it. Enter a value: docs/rig-format.md computes it from"
            " wavelength, f-number and pixel pitch."
        )
    return warnings
