"""Detection of target motion: a step of the target between two captures of one placement.

The fit averages the repeats of a spot. Here the captures of a placement are compared one by one, in the order
in which they were taken, with their prediction by the fit without the placement. The standoff of the
placement is free, so that a wrong standoff is not motion. A step of the target after capture m moves all
later spots as a change of the standoff does: one free number for each m, estimated by generalised least
squares. Other explanations compete: a target that is not square, a spot that is wrong in all its repeats, and
single wrong captures. Motion is reported where its score (see `hypotheses`) is decisively higher than theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from workbench.calibration.checks.cross_validation import by_standoff
from workbench.calibration.checks.hypotheses import SPOT_COST, TILTED_SD, slope_indices
from workbench.calibration.checks.hypothesis import DECISIVE
from workbench.calibration.data.averaging import scatter_chi2
from workbench.calibration.data.observations import Observation, positions, stated_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.refit import Refit, measured, problem_of, refit_with_scale, rows_of
from workbench.model.arrays import BoolArray, FloatArray, IndexArray

FREE_STANDOFF = 10.0
"""Prior deviation of a free standoff, as a factor on the standoff."""
STEP_COST = 2 * log(100 / 0.1)
"""Occam factor of a step: some centimetres of prior range, determined to a tenth of a millimetre."""
FEWEST_BESIDE = 2
"""Least number of captures on either side of a step."""


@dataclass(frozen=True)
class TargetMotion:
    """A step of the target between two captures of one placement."""

    placement: int
    """Index of the placement."""
    step_mm: float
    sd_mm: float
    last_before: str
    """Source of the last capture before the step."""
    first_after: str
    before: int
    """Captures before the step, of `captures`."""
    captures: int


def find_target_motion(fit: CalibrationFit, suspects: Sequence[int]) -> tuple[TargetMotion, ...]:
    """Steps of the target among the suspected placements (their indices)."""
    problem = problem_of(fit)
    found = []
    for index in suspects:
        others = measured(problem) & ~rows_of(fit.cells.placement == index, problem)
        captures = _Captures.of(fit, index)
        if len(captures.observations) >= 2 * FEWEST_BESIDE and others.any():
            start = np.zeros(len(fit.table.parameters))
            reduced = refit_with_scale(problem, others, start)
            found.append(_best_step(fit, captures, reduced, index))
    return tuple(motion for motion in found if motion)


@dataclass(frozen=True)
class _Captures:
    """Captures of one placement in the order taken, with n measured coordinates in all."""

    observations: tuple[Observation, ...]
    capture: IndexArray
    """(n,) index of the capture of each coordinate."""
    axis: IndexArray
    """(n,) 0 for u, 1 for v."""
    cell: IndexArray
    """(n,) index of the cell of each coordinate."""
    position_px: FloatArray
    """(n,)"""
    sd_px: FloatArray
    """(n,) 1 sigma by the scatter of the repeats, without the error that they share."""
    rejected: BoolArray
    """(n,) whether the fit rejected the capture."""

    @classmethod
    def of(cls, fit: CalibrationFit, index: int) -> _Captures:
        cells = {
            fit.rig.laser_ids[fit.cells.laser[n]]: n for n in np.flatnonzero(fit.cells.placement == index)
        }
        key = fit.cells.placements[index].key
        own = tuple(s for s in fit.cells.captures if s.placement == key and s.laser_id in cells)
        used = {s.source for n in cells.values() for s in fit.cells.members[n]}
        position = positions(own)
        capture, axis = np.nonzero(np.isfinite(position))
        cell = np.array([cells[s.laser_id] for s in own], np.intp)[capture]
        scale = {int(n): _repeat_scale(fit, int(n)) for n in cells.values()}
        return cls(
            observations=own,
            capture=capture,
            axis=axis,
            cell=cell,
            position_px=position[capture, axis],
            sd_px=stated_sd(own, fit.rig.noise)[capture, axis] * np.array([scale[n] for n in cell.tolist()]),
            rejected=np.array([s.source not in used for s in own], bool)[capture],
        )


def _repeat_scale(fit: CalibrationFit, cell: int) -> float:
    """Factor on the stated deviations of a cell's repeats.

    For an inconsistent cell the scatter about two means is used, before and after the split with the least
    scatter. A step among the repeats must not count as noise, nor noise as a step.
    """
    usual, members = fit.cells.repeat_scale, fit.cells.members[cell]
    if cell not in fit.cells.inconsistent:
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


def _best_step(fit: CalibrationFit, captures: _Captures, reduced: Refit, index: int) -> TargetMotion | None:
    """The step with the highest score, if it is decisive.

    Let z be the whitened captures, and a_m a whitened step of 1 mm after capture m. The estimated step is
    `a_m z / (a_m a_m)`, the decrease of chi-square `(a_m z)^2 / (a_m a_m)`.
    """
    mean, slope, variance = _prediction(fit, captures, reduced, index)
    distance = captures.position_px - mean
    try:
        whitened = np.linalg.inv(np.linalg.cholesky(variance))
    except np.linalg.LinAlgError:  # a prediction so uncertain that the noise is lost in rounding
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
    alternative = max(
        _alternative_score(captures, whitened, white),
        _tilt_score(whitened @ _by_slope(fit, captures, reduced, index), white),
    )
    if score < DECISIVE or score < alternative + DECISIVE:
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
    fit: CalibrationFit, captures: _Captures, reduced: Refit, index: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Prediction of the n coordinates by the fit without the placement, its standoff free.

    Returns:
        (n,) means, px; (n,) derivatives by the standoff, px/mm; (n, n) covariance, px^2.
    """
    rows = 2 * captures.cell + captures.axis
    sd = fit.cells.sd_px.ravel()[rows] * reduced.scale
    mean = fit.cells.position_px.ravel()[rows] + reduced.residual[rows] * sd
    slope = by_standoff(reduced)[rows] * sd
    own = reduced.jacobian[rows] * sd[:, None]
    shared = (rows[:, None] == rows) * (fit.cells.speckle_sd_px.ravel()[rows] * reduced.scale) ** 2
    standoff = FREE_STANDOFF * fit.cells.placements[index].standoff_mm * slope
    variance = np.diag((captures.sd_px * reduced.scale) ** 2) + shared
    return mean, slope, variance + own @ reduced.covariance @ own.T + np.outer(standoff, standoff)


def _by_slope(fit: CalibrationFit, captures: _Captures, reduced: Refit, index: int) -> FloatArray:
    """(n, 2) shift of the coordinates, px, by slopes of the target of TILTED_SD."""
    rows, slopes = 2 * captures.cell + captures.axis, slope_indices(fit, index)
    sd = fit.cells.sd_px.ravel()[rows] * reduced.scale
    by_prior = reduced.jacobian[np.ix_(rows, slopes)] * sd[:, None]
    return np.asarray(by_prior * TILTED_SD / fit.table.prior_sd[slopes])


def _is_one_spot(lasers: IndexArray, step: int) -> bool:
    """Whether a step separates all captures of one laser from the rest, as a wrong spot does too."""
    before, after = lasers[:step], lasers[step:]
    return not set(before.tolist()) & set(after.tolist()) and 1 in {len(set(before)), len(set(after))}


def _alternative_score(captures: _Captures, whitened: FloatArray, white: FloatArray) -> float:
    """Score of the best explanation without motion: the rejected captures are wrong, or one spot as well."""
    axes = captures.axis[:, None] == np.arange(2)
    outliers = [captures.capture == k for k in sorted(set(captures.capture[captures.rejected].tolist()))]
    spots = [captures.cell == k for k in sorted(set(captures.cell.tolist()))]
    alternatives = [outliers, *([*outliers, spot] for spot in spots)]
    return max(_score(whitened, white, [mask[:, None] & axes for mask in one]) for one in alternatives)


def _tilt_score(columns: FloatArray, white: FloatArray) -> float:
    """Twice the log evidence of a target that is not square, against a square one.

    With a Gaussian prior on the slopes the whitened captures have the covariance 1 + A A^T, A the columns.
    """
    information = np.eye(columns.shape[1]) + columns.T @ columns
    along = columns.T @ white
    return float(along @ np.linalg.solve(information, along) - np.linalg.slogdet(information)[1])


def _score(whitened: FloatArray, white: FloatArray, wrong: list[BoolArray]) -> float:
    """Decrease of chi-square with the positions of wrong spots free, minus their Occam factors.

    The decrease is the squared projection of the whitened captures on the columns (n, 2) of each spot.
    """
    if not wrong:
        return 0.0
    columns = whitened @ np.concatenate(wrong, axis=1).astype(float)
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    projection = basis[:, size > 1e-9 * size.max()].T @ white
    return float(projection @ projection) - SPOT_COST * len(wrong)
