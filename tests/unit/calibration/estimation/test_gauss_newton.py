"""Gauss-Newton against scipy, on problems with and without residuals at the optimum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from workbench.calibration.estimation.gauss_newton import gauss_newton
from workbench.model.arrays import FloatArray

T = np.linspace(0.0, 2.0, 30)
TRUE = np.array([1.5, 0.7])


def exponential(measured: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    value = x[0] * np.exp(-x[1] * T)
    return value - measured, np.column_stack([value / x[0], -T * value])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("sd", [0.0, 0.01])
def test_the_optimum_is_that_of_scipy(seed: int, sd: float) -> None:
    noise = np.random.default_rng(seed).normal(0.0, sd, len(T))
    measured = TRUE[0] * np.exp(-TRUE[1] * T) + noise
    found = gauss_newton(lambda x: exponential(measured, x), np.array([1.0, 1.0]), 12)

    def residual(x: FloatArray) -> FloatArray:
        return exponential(measured, x)[0]

    theirs = least_squares(residual, [1.0, 1.0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(found, theirs.x, rtol=1e-6)


def test_a_linear_problem_takes_one_step_from_anywhere() -> None:
    design = np.random.default_rng(4).normal(size=(10, 3))
    x = np.array([1.0, -2.0, 3.0])
    found = gauss_newton(lambda y: (design @ (y - x), design), np.full(3, 50.0), 1)
    np.testing.assert_allclose(found, x, atol=1e-12)


def test_a_parameter_without_effect_stays_at_its_start() -> None:
    design = np.column_stack([np.ones(5), np.zeros(5)])
    found = gauss_newton(lambda y: (design @ y - 2.0, design), np.array([0.0, 7.0]), 3)
    np.testing.assert_allclose(found, [2.0, 7.0], atol=1e-12)


def test_no_steps_return_the_start_and_do_not_change_it() -> None:
    start = np.array([1.0, 2.0])
    found = gauss_newton(lambda y: (y, np.eye(2)), start, 0)
    np.testing.assert_array_equal(found, start)
    gauss_newton(lambda y: (y, np.eye(2)), start, 1)
    np.testing.assert_array_equal(start, [1.0, 2.0])
