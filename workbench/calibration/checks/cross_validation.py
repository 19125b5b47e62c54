"""Leave-one-standoff-out: does the fit predict a placement that it has not seen as well as it promises?

Each placement is left out in turn and the fit repeated without it. What is left predicts where the spots of
that placement lie, with a covariance: of the parameters, of the placement's own error and tilts (their
priors: nothing is known of this placing), of spot noise and speckle. Spots that lie farther off than that
raise an alarm.

With d the distances of n spots' coordinates in standard deviations of their noise, J their derivatives by the
parameters and C the covariance of the fit without them, d has the covariance V = 1 + J C J^T. The distance in
the direction w in which a wrong standoff moves them, w V^-1 d / (w V^-1 w), is the error of the range that
all spots together give; its variance is 1 / (w V^-1 w). What is not in that direction is in d V^-1 d,
chi-square of n degrees (C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, 2006,
chapter 5.4.2).

Where the fit found its residuals larger than the stated noise, either that noise or some of the data are
wrong. The noise is then taken from the residuals of the other placements, which the one left out cannot have
spoilt, and the tests are those of Student and Fisher for a noise so estimated.
"""

from __future__ import annotations

from dataclasses import dataclass

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
from workbench.model.fit_event import LaserError
from workbench.model.stats import chi2_sf, f_sf, norm_cdf, t_cdf

FALSE_ALARM = 1e-3
"""Of one fit whose priors and noise are as stated: the chance that any of its standoffs raises an alarm."""
FEWEST_PLACEMENTS = 3


@dataclass(frozen=True)
class LeftOut:
    """What the fit without one placement says of it."""

    placement: str
    standoff_mm: float
    error_mm: float
    """Range by all its spots - standoff."""
    sd_mm: float
    """Promised, 1 sigma."""
    chi2: float
    """Of all its spots, against what was promised."""
    coordinates: int
    """Degrees of freedom of `chi2`."""
    freedom: float
    """Of the noise, where it is the other placements'; infinite where it is the stated one."""
    lasers: tuple[LaserError, ...]
    """None on the printed board: without its corners its tilt is anything, and one spot's range with it."""

    @property
    def z(self) -> float:
        """Range error in promised standard deviations."""
        return self.error_mm / self.sd_mm

    @property
    def range_p(self) -> float:
        """Chance of a range error as large."""
        tail = norm_cdf(-abs(self.z)) if np.isinf(self.freedom) else t_cdf(-abs(self.z), self.freedom)
        return float(2 * tail)

    @property
    def spots_p(self) -> float:
        """Chance of spots as far off."""
        if np.isinf(self.freedom):
            return float(chi2_sf(self.chi2, self.coordinates))
        return float(f_sf(self.chi2 / self.coordinates, self.coordinates, self.freedom))


def leave_each_out(fit: CalibrationFit) -> tuple[LeftOut, ...]:
    """Refit without each placement and hold its spots against the prediction.

    Returns:
        One for each placement with spots, in the order of the captures; none with fewer than 3 placements.
    """
    if len(fit.cells.placements) < FEWEST_PLACEMENTS:
        return ()
    problem, start = problem_of(fit), optimum_of(fit)
    seen = sorted(set(fit.cells.placement.tolist()))
    folds = (_leave_out(fit, problem, start, index) for index in seen)
    return tuple(fold for fold in folds if fold is not None)


def alarms(folds: tuple[LeftOut, ...]) -> tuple[LeftOut, ...]:
    """Those farther off than the fits promised, with FALSE_ALARM for all tests of all placements together."""
    limit = FALSE_ALARM / (2 * max(len(folds), 1))
    return tuple(fold for fold in folds if min(fold.range_p, fold.spots_p) < limit)


def _leave_out(
    fit: CalibrationFit, problem: LeastSquaresProblem, start: FloatArray, index: int
) -> LeftOut | None:
    cells = fit.cells.placement == index
    spots = rows_of(cells, problem) & measured(problem)
    info = fit.cells.placements[index]
    others = measured(problem) & ~rows_at(problem, index)
    solve = refit_with_scale if fit.noise_scale > 1 else refit
    left = solve(problem, others, _without(start, fit, info.key))
    w = by_standoff(left)
    if not (w[spots] ** 2).sum() > 0:  # no coordinate that a range moves
        return None
    error, sd = range_error(left, spots, w)
    lasers = []
    on_board = any(view.placement.key == info.key for view in fit.boards)
    for laser, laser_id in enumerate(fit.rig.laser_ids):
        mine = spots & rows_of(cells & (fit.cells.laser == laser), problem)
        if not on_board and (w[mine] ** 2).sum() > 0:
            error_of_one, sd_of_one = range_error(left, mine, w)
            lasers.append(LaserError(laser_id=laser_id, error_mm=error_of_one, sd_mm=sd_of_one))
    chi2 = deleted_chi2(left, spots)
    return LeftOut(
        placement=info.key,
        standoff_mm=info.standoff_mm,
        error_mm=error,
        sd_mm=sd,
        chi2=chi2,
        coordinates=int(spots.sum()),
        freedom=left.freedom if fit.noise_scale > 1 else np.inf,
        lasers=tuple(lasers),
    )


def rows_at(problem: LeastSquaresProblem, index: int) -> BoolArray:
    """(R,) rows of everything seen at a placement, corners of the board too."""
    placement = np.concatenate([problem.data.spots.placement, problem.data.corners.placement])
    return np.repeat(placement == index, 2)


def _without(start: FloatArray, fit: CalibrationFit, key: str) -> FloatArray:
    """The optimum with the placement's own parameters where they are without its data: at their priors."""
    own = [p.name.rpartition(".")[0] == key and p.kind == "placement" for p in fit.table.parameters]
    return np.where(own, 0.0, start)


def by_standoff(left: Refit) -> FloatArray:
    """(R,) change of the residuals with the standoff of their placement, a mm."""
    return left.problem.by_standoff(left.y, left.scale)


def predictive(left: Refit, rows: BoolArray) -> FloatArray:
    """(n, n) covariance of the residuals of rows that the refit has not used."""
    own = left.jacobian[rows]
    return np.eye(len(own)) + own @ left.covariance @ own.T


def deleted_chi2(left: Refit, rows: BoolArray) -> float:
    """Distance of rows that the refit has not used from their prediction, squared."""
    distance = left.residual[rows]
    return float(distance @ np.linalg.solve(predictive(left, rows), distance))


def range_error(left: Refit, rows: BoolArray, w: FloatArray) -> tuple[float, float]:
    """Range by the spots of `rows` - their standoff, and its standard deviation, mm."""
    weight = np.linalg.solve(predictive(left, rows), w[rows])
    information = float(weight @ w[rows])
    # A target farther than the ruler says moves the measurement as w; the residual is predicted - measured.
    return -float(weight @ left.residual[rows]) / information, information**-0.5
