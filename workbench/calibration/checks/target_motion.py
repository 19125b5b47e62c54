"""Did a placement move while its captures were taken?

The fit averages the repeats of a spot; here a placement's captures are looked at one by one, in the order in
which they were taken, against the fit without the placement. Its standoff is free, so that a wrong one is no
movement. A step of the target after capture m moves all later spots along their lines by what a standoff
would: that is one number for each m. What else may have spoilt captures competes: a spot that lies apart in
all its repeats, and single captures that do. Movement is named where it explains decisively more than either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from workbench.calibration.checks.cross_validation import by_standoff
from workbench.calibration.checks.hypotheses import DECISIVE, SPOT_COST
from workbench.calibration.data.averaging import scatter_chi2
from workbench.calibration.data.observations import Observation, positions, stated_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.refit import Refit, measured, problem_of, refit_with_scale, rows_of
from workbench.model.arrays import BoolArray, FloatArray, IndexArray

ANYWHERE = 10.0
"""Prior deviation of a standoff that is free, as a factor on the standoff."""
STEP_COST = 2 * log(100 / 0.1)
"""Some centimetres that a target may have moved by, over the tenth of a millimetre to which spots fix it."""
FEWEST_BESIDE = 2
"""Captures on either side of a step: a single one is no movement."""


@dataclass(frozen=True)
class TargetMotion:
    """A step of the target between two captures of one placement."""

    placement: int
    step_mm: float
    sd_mm: float
    last_before: str
    """Source of the last capture before the step."""
    first_after: str
    before: int
    """Captures before the step, of `captures`."""
    captures: int


def find_target_motion(fit: CalibrationFit, suspects: Sequence[int]) -> tuple[TargetMotion, ...]:
    """Placements that moved, among those (by index) that something is wrong with."""
    problem = problem_of(fit)
    found = []
    for index in suspects:
        mine = rows_of(fit.cells.placement == index, problem)
        others = measured(problem) & ~mine
        captures = _Captures.of(fit, index)
        if len(captures.observations) >= 2 * FEWEST_BESIDE and others.any():
            start = np.zeros(len(fit.table.parameters))
            left = refit_with_scale(problem, others, start)
            found.append(_movement(fit, captures, left, index))
    return tuple(movement for movement in found if movement)


@dataclass(frozen=True)
class _Captures:
    """One placement's captures in their order, n measured coordinates in all."""

    observations: tuple[Observation, ...]
    capture: IndexArray
    """(n,) which capture a coordinate is of."""
    axis: IndexArray
    cell: IndexArray
    """(n,) which cell of the fit it belongs to."""
    position_px: FloatArray
    sd_px: FloatArray
    """(n,) as the repeats of the fit scatter; shared errors are apart from it."""
    stray: BoolArray

    @classmethod
    def of(cls, fit: CalibrationFit, index: int) -> _Captures:
        cells = {
            fit.rig.laser_ids[fit.cells.laser[n]]: n for n in np.flatnonzero(fit.cells.placement == index)
        }
        key = fit.cells.placements[index].key
        mine = tuple(s for s in fit.cells.captures if s.placement == key and s.laser_id in cells)
        used = {s.source for n in cells.values() for s in fit.cells.members[n]}
        position = positions(mine)
        capture, axis = np.nonzero(np.isfinite(position))
        cell = np.array([cells[s.laser_id] for s in mine], np.intp)[capture]
        scale = {int(n): _repeat_scale(fit, int(n)) for n in cells.values()}
        return cls(
            observations=mine,
            capture=capture,
            axis=axis,
            cell=cell,
            position_px=position[capture, axis],
            sd_px=stated_sd(mine, fit.rig.noise)[capture, axis] * np.array([scale[n] for n in cell.tolist()]),
            stray=np.array([s.source not in used for s in mine], bool)[capture],
        )


def _repeat_scale(fit: CalibrationFit, cell: int) -> float:
    """Factor on the stated deviations of a spot's repeats.

    Repeats that scatter more than all others (torn) are as noisy as they are to both sides of the split that
    leaves the least: a step among them is then no noise, and noise is no step.
    """
    usual, members = fit.cells.repeat_scale, fit.cells.members[cell]
    if cell not in fit.cells.torn:
        return usual
    position, sd = positions(members), stated_sd(members, fit.rig.noise)
    split = [
        [scatter_chi2(position[part], sd[part]) for part in (slice(m), slice(m, None))]
        for m in range(1, len(members))
    ]
    chi2, free = (
        sum(column) for column in zip(*min(split, key=lambda two: two[0][0] + two[1][0]), strict=True)
    )
    return max(usual, (chi2 / free) ** 0.5) if free else usual


def _movement(fit: CalibrationFit, captures: _Captures, left: Refit, index: int) -> TargetMotion | None:
    mean, slope, variance = _prediction(fit, captures, left, index)
    distance = captures.position_px - mean
    try:
        whitened = np.linalg.inv(np.linalg.cholesky(variance))
    except np.linalg.LinAlgError:  # the others tell so little of it that rounding is larger than the noise
        return None
    lasers = captures.cell[np.searchsorted(captures.capture, np.arange(len(captures.observations)))]
    steps = [
        m
        for m in range(FEWEST_BESIDE, len(captures.observations) - FEWEST_BESIDE + 1)
        if not _is_one_spot(lasers, m)
    ]
    if not steps:
        return None
    columns = slope[:, None] * (captures.capture[:, None] >= np.array(steps))
    columns, white = whitened @ columns, whitened @ distance
    information = (columns**2).sum(axis=0)
    gain = (columns.T @ white) ** 2 / information
    best = int(np.argmax(gain))
    score = gain[best] - STEP_COST - 2 * log(len(steps))
    if score < DECISIVE or score < _rival(captures, whitened, white) + DECISIVE:
        return None
    before = steps[best]
    return TargetMotion(
        placement=index,
        step_mm=float(columns[:, best] @ white / information[best]),
        sd_mm=float(information[best] ** -0.5),
        last_before=captures.observations[before - 1].source,
        first_after=captures.observations[before].source,
        before=before,
        captures=len(captures.observations),
    )


def _prediction(
    fit: CalibrationFit, captures: _Captures, left: Refit, index: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where each coordinate is expected, its change by the standoff (a mm), and (n, n) covariance."""
    rows = 2 * captures.cell + captures.axis
    sd = fit.cells.sd_px.ravel()[rows] * left.scale
    mean = fit.cells.position_px.ravel()[rows] + left.residual[rows] * sd
    slope = by_standoff(left)[rows] * sd
    own = left.jacobian[rows] * sd[:, None]
    shared = rows[:, None] == rows
    variance = (
        np.diag((captures.sd_px * left.scale) ** 2) + shared * (fit.rig.noise.speckle_sd_px * left.scale) ** 2
    )
    anywhere = ANYWHERE * fit.cells.placements[index].standoff_mm * slope
    return mean, slope, variance + own @ left.covariance @ own.T + np.outer(anywhere, anywhere)


def _is_one_spot(lasers: IndexArray, step: int) -> bool:
    """Whether a step only sets all captures of one laser apart: that may be a wrong spot as well."""
    before, after = lasers[:step], lasers[step:]
    return not set(before.tolist()) & set(after.tolist()) and 1 in {len(set(before)), len(set(after))}


def _rival(captures: _Captures, whitened: FloatArray, white: FloatArray) -> float:
    """Score of the best other account: single captures are wrong, or besides one whole spot is."""
    axes = captures.axis[:, None] == np.arange(2)
    strays = [captures.capture == k for k in sorted(set(captures.capture[captures.stray].tolist()))]
    spots = [captures.cell == k for k in sorted(set(captures.cell.tolist()))]
    accounts = [strays, *([*strays, spot] for spot in spots)]
    return max(_score(whitened, white, [mask[:, None] & axes for mask in account]) for account in accounts)


def _score(whitened: FloatArray, white: FloatArray, wrong: list[BoolArray]) -> float:
    if not wrong:
        return 0.0
    columns = whitened @ np.concatenate(wrong, axis=1).astype(float)
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    told = basis[:, size > 1e-9 * size.max()].T @ white
    return float(told @ told) - SPOT_COST * len(wrong)
