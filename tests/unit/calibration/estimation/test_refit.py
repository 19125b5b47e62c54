"""Refits against fits of fewer data, and against the solver of the fit."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.support.rigs import World, thesis_rig
from workbench.calibration.estimation.fit import fit
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
from workbench.model.arrays import FloatArray

RIG = thesis_rig()


@pytest.mark.parametrize("standoff_mm", [125.0, 600.0, 4500.0])
def test_a_fold_is_the_fit_without_the_placement(standoff_mm: float) -> None:
    observations = World(RIG, 1).observations()
    whole = fit(RIG, observations)
    without = fit(RIG, [s for s in observations if s.standoff_mm != standoff_mm])
    problem = problem_of(whole)
    cells = np.array([whole.cells.placements[i].standoff_mm == standoff_mm for i in whole.cells.placement])
    left = refit(problem, measured(problem) & ~rows_of(cells, problem), optimum_of(whole))
    sensor = whole.sensor
    values = (whole.table.prior_mean + whole.table.prior_sd * left.y)[sensor]
    free = whole.table.prior_sd[sensor] > 0
    off = (values - without.values[sensor])[free] / without.sd[sensor][free]
    assert np.abs(off).max() < 1e-3
    sd = whole.table.prior_sd[sensor] * np.sqrt(np.diag(left.covariance)[sensor])
    np.testing.assert_allclose(sd, without.sd[sensor], rtol=1e-3)


@pytest.fixture(scope="module")
def whole() -> Refit:
    fitted = fit(RIG, World(RIG, 1).observations(repeats=2))
    problem = problem_of(fitted)
    return refit(problem, measured(problem), np.zeros(len(fitted.values)))


def test_from_the_priors_it_comes_to_the_solver_s_optimum(whole: Refit) -> None:
    solution = whole.problem.solve(1.0)
    off = (whole.y - solution.y) / np.sqrt(np.diag(solution.covariance))
    assert np.abs(off).max() < 1e-2
    np.testing.assert_allclose(np.diag(whole.covariance), np.diag(solution.covariance), rtol=1e-4)
    assert whole.freedom == pytest.approx(solution.degrees_of_freedom, rel=1e-6)
    assert whole.chi2 == pytest.approx(solution.chi2, rel=1e-4)
    assert whole.cost == pytest.approx(whole.chi2 + whole.y @ whole.y)


def test_the_optimum_of_a_fit_is_counted_from_its_priors() -> None:
    fitted = fit(RIG, World(RIG, 1).observations(repeats=2))
    y = optimum_of(fitted)
    np.testing.assert_allclose(y, fitted.prior_pull, atol=1e-9)
    np.testing.assert_allclose(fitted.table.prior_mean + fitted.table.prior_sd * y, fitted.values)


def test_predicted_positions_are_measured_minus_residual(whole: Refit) -> None:
    data = whole.problem.data
    sd = 1.0 / np.asarray(data.inverse_sd)
    expected = np.asarray(data.position_px) + whole.residual.reshape(-1, 2) * sd
    np.testing.assert_allclose(whole.predicted_px, expected, rtol=1e-9)


def test_rows_of_a_cell_are_its_two_coordinates() -> None:
    fitted = fit(RIG, World(RIG, 1).observations((160.0, 400.0), repeats=1))
    problem = problem_of(fitted)
    chosen = np.zeros(len(fitted.cells.laser), bool)
    chosen[2] = True
    assert np.flatnonzero(rows_of(chosen, problem)).tolist() == [4, 5]


def test_fewer_rows_leave_more_variance_and_less_freedom(whole: Refit) -> None:
    half = whole.used & (np.arange(len(whole.used)) % 4 < 2)
    left = refit(whole.problem, half, whole.y)
    assert (np.diag(left.covariance) >= np.diag(whole.covariance) - 1e-12).all()
    assert left.freedom < whole.freedom
    assert left.chi2 < whole.chi2


def test_at_twice_the_noise_the_residuals_are_half_as_many_deviations(whole: Refit) -> None:
    double = whole.at(2.0)
    residual, _ = whole.problem.linearise(double.y)
    np.testing.assert_allclose(double.residual, residual / 2.0, atol=1e-12)
    assert (np.diag(double.covariance) >= np.diag(whole.covariance)).all()


def test_noise_larger_than_stated_is_taken_from_the_residuals() -> None:
    """Stated noise three times too small: the scale is known to 1 / sqrt(2 x freedom) = 8 %."""
    rig = thesis_rig(noise_px=0.04 / 3, speckle_px=0.04 / 3)
    fitted = fit(rig, World(thesis_rig(0.04, 0.04), 3).observations(repeats=1))
    problem = problem_of(fitted)
    found = refit_with_scale(problem, measured(problem), np.zeros(len(fitted.values)))
    assert found.scale == pytest.approx(3.0, rel=0.3)
    assert found.chi2 / found.freedom == pytest.approx(1.0, abs=0.03)


def test_other_numbers_in_unused_rows_leave_the_optimum_alone(whole: Refit) -> None:
    used = whole.used.copy()
    used[:2] = False
    left = refit(whole.problem, used, whole.y)
    position = np.array(whole.problem.data.position_px)
    position[0] += 5.0
    other = left.with_unused(
        LeastSquaresProblem(whole.problem.layout, whole.problem.data._replace(position_px=position))
    )
    assert other.chi2 == pytest.approx(left.chi2)
    assert np.array_equal(other.covariance, left.covariance)
    shift = 5.0 * np.asarray(whole.problem.data.inverse_sd)[0]
    np.testing.assert_allclose(other.residual[:2], left.residual[:2] - shift, rtol=1e-6)


class Saturated:
    """Residuals that flatten out on both sides of `centre`, where a Gauss-Newton step is far too long."""

    centre = np.array([0.5, -0.8, 0.3])
    slope = np.array([3.0, 1.0, 0.2])
    evaluations = 0

    def linearise(self, y: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        self.evaluations += 1
        at = self.slope * (y - self.centre)
        return 10.0 * np.arctan(at) / scale, np.diag(10.0 * self.slope / (1.0 + at**2)) / scale


@pytest.mark.parametrize("start", [(3.0, -4.0, 6.0), (-2.0, 5.0, 0.0), (0.0, 0.0, -9.0)])
@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_steps_that_would_ascend_are_damped(start: tuple[float, ...], scale: float) -> None:
    problem = Saturated()

    def cost(y: FloatArray) -> float:
        residual, _ = problem.linearise(y, scale)
        return float(residual @ residual + y @ y)

    found = refit(cast(LeastSquaresProblem, problem), np.ones(3, bool), np.array(start), scale)
    expected = minimize(cost, problem.centre, method="BFGS").x
    # The last step is a thousandth of a posterior deviation, which here is below that of the prior.
    np.testing.assert_allclose(found.y, expected, atol=1e-3)
    np.testing.assert_array_equal(found.residual, problem.linearise(found.y, scale)[0])
    assert found.cost == pytest.approx(cost(found.y))


def test_a_refit_from_its_optimum_stays_there() -> None:
    problem = Saturated()
    once = refit(cast(LeastSquaresProblem, problem), np.ones(3, bool), np.zeros(3))
    problem.evaluations = 0
    again = refit(cast(LeastSquaresProblem, problem), once.used, once.y)
    assert problem.evaluations == 2  # at the start and after the last step
    np.testing.assert_allclose(again.y, once.y, atol=1e-6)
    assert again.cost <= once.cost
