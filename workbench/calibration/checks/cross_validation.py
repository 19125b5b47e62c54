"""Cross-validation: each placement is ranged by the fit without it.

Each placement is left out in turn and the fit repeated without it. The reduced fit predicts the spots of the
placement. The covariance of the prediction includes the parameters, the placement's own error and tilts (at
their priors), spot noise and speckle. Spots too far from their prediction raise an alarm.

Let d be the residuals of n spot coordinates in standard deviations of their noise, J their derivatives by the
parameters, C the covariance of the fit without them. Then d has the covariance V = 1 + J C J^T. A wrong
standoff moves the residuals in the direction w. The generalised least-squares estimate of that shift,
w V^-1 d / (w V^-1 w), is to first order the range error of all spots together. Its variance is
1 / (w V^-1 w); the quotient is tested. Spots are linear in the inverse depth, far better than in the
range: the range itself is found by steps in the inverse depth, and may lie beyond infinity. The test of all
coordinates is d V^-1 d, chi-square with n degrees of freedom (C. E. Rasmussen, C. K. I. Williams,
Gaussian Processes for Machine Learning, 2006, chapter 5.4.2).

Where the residuals of the fit are larger than the stated noise, either the stated noise or some of the data
are wrong. The noise is then estimated from the residuals of the other placements, which the placement left
out cannot affect, and the tests are Student's t and Fisher's F.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import (
    Refit,
    measured,
    optimum_of,
    problem_of,
    refit,
    refit_with_scale,
    rows_of,
)
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.fit_event import CrossValidatedPlacement, LaserError

FALSE_ALARM = 1e-3
"""Probability that any placement of a fit raises an alarm when priors and noise are as stated."""
FEWEST_PLACEMENTS = 3
SMALL_STEP = 0.02
"""Relative step of the range below which no further one is made: spots are linear in the inverse depth."""
MOST_STEPS = 8
LEAST_INVERSE_DEPTH = 1e-3
"""Inverse depth, relative to that of the standoff, below which the range counts as infinite."""


def leave_each_out(fit: CalibrationFit) -> tuple[CrossValidatedPlacement, ...]:
    """Refit without each placement and test its spots against their prediction.

    The false-alarm rate FALSE_ALARM is divided among both tests of all placements (Bonferroni).

    Returns:
        One entry for each placement with spots, in the order of the captures; none with fewer than 3
        placements.
    """
    if len(fit.cells.placements) < FEWEST_PLACEMENTS:
        return ()
    problem, start = problem_of(fit), optimum_of(fit)
    seen = sorted(set(fit.cells.placement.tolist()))
    tested = [one for index in seen if (one := _leave_out(fit, problem, start, index)) is not None]
    limit = FALSE_ALARM / (2 * max(len(tested), 1))
    return tuple(one.model_copy(update={"alarm": min(one.range_p, one.spots_p) < limit}) for one in tested)


def alarms(placements: Sequence[CrossValidatedPlacement]) -> tuple[CrossValidatedPlacement, ...]:
    """The placements that raise an alarm."""
    return tuple(one for one in placements if one.alarm)


def _leave_out(
    fit: CalibrationFit, problem: LeastSquaresProblem, start: FloatArray, index: int
) -> CrossValidatedPlacement | None:
    """The placement, tested; None where no coordinate of its spots depends on the range."""
    cells = fit.cells.placement == index
    spots = rows_of(cells, problem) & measured(problem)
    info = fit.cells.placements[index]
    others = measured(problem) & ~rows_at(problem, index)
    solve = refit_with_scale if fit.noise_scale > 1 else refit
    reduced = solve(problem, others, _at_priors(start, fit, info.key))
    w = by_standoff(reduced)
    if not (w[spots] ** 2).sum() > 0:
        return None
    first_order_mm, sd = range_error(reduced, spots, w)
    on_board = any(view.placement.key == info.key for view in fit.boards)
    return CrossValidatedPlacement(
        placement=info.key,
        standoff_mm=info.standoff_mm,
        error_mm=iterated_error(reduced, index, spots, info.standoff_mm, _offset_mm(fit)),
        sd_mm=sd,
        score=first_order_mm / sd,
        lasers=() if on_board else _laser_errors(fit, reduced, index, spots, w),
        chi2=deleted_chi2(reduced, spots),
        coordinates=int(spots.sum()),
        freedom=reduced.freedom if fit.noise_scale > 1 else None,
    )


def iterated_error(
    reduced: Refit, index: int, rows: BoolArray, standoff_mm: float, offset_mm: float
) -> float | None:
    """Range by the spots of `rows` - standoff of their placement, mm; None beyond infinity.

    Args:
        reduced: the refit without the placement.
        index: index of the placement.
        rows: (R,) rows of its spots.
        standoff_mm: its standoff by the ruler.
        offset_mm: depth of the pinhole behind the reference plane.
    """
    depth_mm = standoff_mm + offset_mm
    step_mm = range_error(reduced, rows, by_standoff(reduced))[0]
    for _ in range(MOST_STEPS):
        inverse = (1.0 - step_mm / depth_mm) / depth_mm
        if inverse * (standoff_mm + offset_mm) < LEAST_INVERSE_DEPTH:
            return None
        is_last = abs(step_mm) < SMALL_STEP * depth_mm
        depth_mm = 1.0 / inverse
        if is_last:
            break
        there = reduced.with_unused(problem_at(reduced.problem, index, depth_mm - offset_mm))
        step_mm = range_error(there, rows, by_standoff(there))[0]
    return depth_mm - offset_mm - standoff_mm


def _offset_mm(fit: CalibrationFit) -> float:
    return fit.rig.bench.offset_mm.value


def _laser_errors(
    fit: CalibrationFit, reduced: Refit, index: int, spots: BoolArray, w: FloatArray
) -> tuple[LaserError, ...]:
    """Range errors of single lasers, for those whose spots among the rows `spots` depend on the range."""
    errors = []
    for laser, laser_id in enumerate(fit.rig.laser_ids):
        own = spots & rows_of(fit.cells.laser == laser, reduced.problem)
        if (w[own] ** 2).sum() > 0:
            standoff_mm, sd_mm = fit.cells.placements[index].standoff_mm, range_error(reduced, own, w)[1]
            error_mm = iterated_error(reduced, index, own, standoff_mm, _offset_mm(fit))
            errors.append(LaserError(laser_id=laser_id, error_mm=error_mm, sd_mm=sd_mm))
    return tuple(errors)


def rows_at(problem: LeastSquaresProblem, index: int) -> BoolArray:
    """(R,) rows of all spots and corners at a placement."""
    placement = np.concatenate([problem.data.spots.placement, problem.data.corners.placement])
    return np.repeat(placement == index, 2)


def _at_priors(start: FloatArray, fit: CalibrationFit, key: str) -> FloatArray:
    """(P,) the optimum, with the placement's own parameters at their prior means: the solution without it."""
    own = [p.name.rpartition(".")[0] == key and p.kind == "placement" for p in fit.table.parameters]
    return np.where(own, 0.0, start)


def by_standoff(reduced: Refit) -> FloatArray:
    """(R,) derivatives of the residuals by the standoff of their placement, 1/mm."""
    return reduced.problem.by_standoff(reduced.y, reduced.scale)


def predictive(reduced: Refit, rows: BoolArray) -> FloatArray:
    """(n, n) covariance V of the residuals of rows that the refit does not use."""
    own = reduced.jacobian[rows]
    return np.eye(len(own)) + own @ reduced.covariance @ own.T


def deleted_chi2(reduced: Refit, rows: BoolArray) -> float:
    """Chi-square d V^-1 d of rows that the refit does not use."""
    distance = reduced.residual[rows]
    return float(distance @ np.linalg.solve(predictive(reduced, rows), distance))


def problem_at(problem: LeastSquaresProblem, index: int, standoff_mm: float) -> LeastSquaresProblem:
    """The problem with another standoff of one placement."""
    standoff = np.array(problem.data.standoff_mm, float)
    standoff[index] = standoff_mm
    return LeastSquaresProblem(problem.layout, problem.data._replace(standoff_mm=standoff))


def range_error(reduced: Refit, rows: BoolArray, w: FloatArray) -> tuple[float, float]:
    """Range by the spots of `rows` - their standoff, and its standard deviation, mm, to first order."""
    weight = np.linalg.solve(predictive(reduced, rows), w[rows])
    information = float(weight @ w[rows])
    # A target farther than the ruler's value moves the measurement by w; residuals are predicted - measured.
    return -float(weight @ reduced.residual[rows]) / information, information**-0.5
