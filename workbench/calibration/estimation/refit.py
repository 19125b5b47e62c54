"""Refits beside the fit: some of its data left out, or another hypothesis about them.

Every refit linearises the program that the fit has compiled, at other numbers of the same shapes: none
compiles anything, and started at the fit's optimum it takes a few milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.model.arrays import BoolArray, FloatArray

STEP_TOLERANCE_SD = 1e-3
"""Of the last step, in posterior standard deviations: the next would be shorter by far."""
MAX_STEPS = 60
SCALE_ROUNDS = 5


@dataclass(frozen=True)
class Refit:
    """An optimum over the data of `used`. P parameters in units of their priors, R = 2 M rows of data."""

    problem: LeastSquaresProblem
    used: BoolArray
    """(R,) rows that were fitted."""
    y: FloatArray
    """(P,)"""
    scale: float
    """Factor on the stated noise that the rows used called for."""
    residual: FloatArray
    """(R,) predicted - measured in standard deviations of that noise, of all rows, used or not."""
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
        """Of the rows used, at the noise of this refit."""
        return float(self.residual[self.used] @ self.residual[self.used])

    @property
    def cost(self) -> float:
        """Misfit of data and priors together; if all is right, chi-square of a degree for each row used."""
        return self.chi2 + float(self.y @ self.y)

    @property
    def freedom(self) -> float:
        """Rows used minus the parameters that they determine, weighed by how well."""
        rows = self.jacobian[self.used]
        return float(self.used.sum() - np.einsum("ij,jk,ik->", rows, self.covariance, rows))

    def with_unused(self, problem: LeastSquaresProblem) -> Refit:
        """The same refit, where only rows that it has not used have other numbers."""
        residual, jacobian = problem.linearise(self.y, self.scale)
        other = Refit(problem, self.used, self.y, self.scale, residual, jacobian)
        vars(other)["covariance"] = self.covariance  # of the rows used: to invert it again is dear
        return other

    def at(self, scale: float) -> Refit:
        """The same rows fitted at another noise."""
        return refit(self.problem, self.used, self.y, scale)


def rows_of(cells: BoolArray, problem: LeastSquaresProblem) -> BoolArray:
    """(R,) rows of data of the spots' cells (N,), measured or not; corners have none."""
    corners = np.zeros(len(np.asarray(problem.data.inverse_sd)) - len(cells), bool)
    return np.repeat(np.concatenate([cells, corners]), 2)


def measured(problem: LeastSquaresProblem) -> BoolArray:
    """(R,) rows that carry a measurement."""
    return np.asarray(problem.data.inverse_sd).ravel() > 0


def problem_of(fit: CalibrationFit) -> LeastSquaresProblem:
    """The problem that a fit has solved."""
    return LeastSquaresProblem.of(fit.rig, fit.table, fit.cells, fit.boards)


def optimum_of(fit: CalibrationFit) -> FloatArray:
    """(P,) of a fit, in units of the priors counted from their means."""
    sd = fit.table.prior_sd
    return np.where(sd > 0, (fit.values - fit.table.prior_mean) / np.where(sd > 0, sd, 1.0), 0.0)


def refit(problem: LeastSquaresProblem, used: BoolArray, start: FloatArray, scale: float = 1.0) -> Refit:
    """Levenberg-Marquardt on the rows used, at a given noise."""
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
            if damping > 1e10:
                break
            damping = max(10 * damping, 1e-4)
            continue
        y, residual, jacobian, cost = y + step, tried, trial_jacobian, trial
        if damping == 0 and abs(step @ gradient) < STEP_TOLERANCE_SD**2:
            break
        damping = damping / 10 if damping > 1e-6 else 0.0
    return Refit(problem, used, y, scale, residual, jacobian)


def refit_with_scale(problem: LeastSquaresProblem, used: BoolArray, start: FloatArray) -> Refit:
    """As `refit`, at the noise that the residuals of the rows used show, if that is more than stated."""
    found = refit(problem, used, start)
    for _ in range(SCALE_ROUNDS):
        shown = found.scale * (found.chi2 / max(found.freedom, 1.0)) ** 0.5
        if not shown > found.scale * 1.01:
            break
        found = found.at(shown)
    return found


def _cost(residual: FloatArray, y: FloatArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        return float(residual @ residual + y @ y)
