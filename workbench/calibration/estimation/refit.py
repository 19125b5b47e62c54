"""Refits of a fit's problem without some of its data, or under another hypothesis about them.

A refit evaluates the program that the fit has compiled, with other arrays of the same shapes. Nothing is
compiled, and from the fit's optimum a refit takes a few milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.model.arrays import BoolArray, FloatArray

STEP_TOLERANCE_SD = 1e-3
"""Length of the last step in posterior standard deviations; convergence is fast, the next is far shorter."""
MAX_STEPS = 60
SCALE_ROUNDS = 5
SCALE_TOLERANCE = 1.01
FIRST_DAMPING = 1e-4
LEAST_DAMPING = 1e-6
"""Damping below this becomes 0: the step is then Gauss-Newton's."""
MOST_DAMPING = 1e10
"""Damping above which no step descends: the optimum is reached to rounding."""


@dataclass(frozen=True)
class Refit:
    """Optimum over the rows `used` of the data: P parameters in units of their priors, R = 2 M rows."""

    problem: LeastSquaresProblem
    used: BoolArray
    """(R,) rows that were fitted."""
    y: FloatArray
    """(P,)"""
    scale: float
    """Factor on the stated noise."""
    residual: FloatArray
    """(R,) predicted - measured of all rows, used or not, in standard deviations of the scaled noise."""
    jacobian: FloatArray
    """(R, P) of `residual` by y."""

    @cached_property
    def covariance(self) -> FloatArray:
        """(P, P) of y."""
        rows = self.jacobian[self.used]
        return np.asarray(np.linalg.inv(rows.T @ rows + np.eye(len(self.y))), np.float64)

    @property
    def predicted_px(self) -> FloatArray:
        """(M, 2) positions, measured or not."""
        data = self.problem.data
        plain = data._replace(inverse_sd=np.ones_like(np.asarray(data.inverse_sd)))
        residual, _ = LeastSquaresProblem(self.problem.layout, plain).linearise(self.y)
        return np.asarray(data.position_px + residual.reshape(-1, 2))

    @property
    def chi2(self) -> float:
        """Chi-square of the used rows at the scaled noise."""
        return float(self.residual[self.used] @ self.residual[self.used])

    @property
    def cost(self) -> float:
        """Chi-square of data and priors; its expectation is the number of used rows."""
        return self.chi2 + float(self.y @ self.y)

    @property
    def freedom(self) -> float:
        """Number of used rows minus the effective number of parameters, tr(J C J^T)."""
        rows = self.jacobian[self.used]
        return float(self.used.sum() - np.einsum("ij,jk,ik->", rows, self.covariance, rows))

    def with_unused(self, problem: LeastSquaresProblem) -> Refit:
        """The same optimum in a problem that differs only in rows that are not used."""
        residual, jacobian = problem.linearise(self.y, self.scale)
        other = Refit(problem, self.used, self.y, self.scale, residual, jacobian)
        vars(other)["covariance"] = self.covariance  # of the used rows, so unchanged: an inversion saved
        return other

    def at(self, scale: float) -> Refit:
        """Refit of the same rows at another noise."""
        return refit(self.problem, self.used, self.y, scale)


def rows_of(cells: BoolArray, problem: LeastSquaresProblem) -> BoolArray:
    """(R,) rows of the selected cells (N,), measured or not; no rows of corners."""
    corners = np.zeros(len(np.asarray(problem.data.inverse_sd)) - len(cells), bool)
    return np.repeat(np.concatenate([cells, corners]), 2)


def measured(problem: LeastSquaresProblem) -> BoolArray:
    """(R,) rows with a measurement."""
    return np.asarray(problem.data.inverse_sd).ravel() > 0


def problem_of(fit: CalibrationFit) -> LeastSquaresProblem:
    """The problem that a fit solved."""
    return LeastSquaresProblem.of(fit.rig, fit.table, fit.cells, fit.boards)


def optimum_of(fit: CalibrationFit) -> FloatArray:
    """(P,) optimum of a fit, (value - prior mean) / prior sd."""
    sd = fit.table.prior_sd
    return np.where(sd > 0, (fit.values - fit.table.prior_mean) / np.where(sd > 0, sd, 1.0), 0.0)


def refit(problem: LeastSquaresProblem, used: BoolArray, start: FloatArray, scale: float = 1.0) -> Refit:
    """Levenberg-Marquardt on the used rows, at a given noise.

    Written out, not scipy's: one call of the compiled program gives residuals and derivatives together, and
    the undamped first steps make it some milliseconds from the fit's optimum.
    """
    y, damping = np.array(start), 0.0
    residual, jacobian = problem.linearise(y, scale)
    cost = _cost(residual[used], y)
    for _ in range(MAX_STEPS):
        rows = jacobian[used]
        information = rows.T @ rows + np.eye(len(y))
        gradient = rows.T @ residual[used] + y
        step = np.linalg.solve(information + damping * np.diag(np.diag(information)), -gradient)
        tried, trial_jacobian = problem.linearise(y + step, scale)
        trial = _cost(tried[used], y + step)
        if not trial <= cost * (1 + 1e-12):
            if damping > MOST_DAMPING:
                break
            damping = max(10 * damping, FIRST_DAMPING)
            continue
        y, residual, jacobian, cost = y + step, tried, trial_jacobian, trial
        if damping == 0 and abs(step @ gradient) < STEP_TOLERANCE_SD**2:
            break
        damping = damping / 10 if damping > LEAST_DAMPING else 0.0
    return Refit(problem, used, y, scale, residual, jacobian)


def refit_with_scale(problem: LeastSquaresProblem, used: BoolArray, start: FloatArray) -> Refit:
    """`refit` at the noise estimated from the used rows, if that is larger than stated."""
    found = refit(problem, used, start)
    for _ in range(SCALE_ROUNDS):
        estimated = found.scale * (found.chi2 / max(found.freedom, 1.0)) ** 0.5
        if not estimated > found.scale * SCALE_TOLERANCE:
            break
        found = found.at(estimated)
    return found


def _cost(residual: FloatArray, y: FloatArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        return float(residual @ residual + y @ y)
