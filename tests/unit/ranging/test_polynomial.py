"""Polynomials through spots against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.statistics import inverse_of_information
from tests.support.surfaces import X, cubic, fit_polynomial, flat, incline, parabola, seen
from workbench.model.arrays import FloatArray
from workbench.ranging.points import Points

SEEDS = (1, 2, 3)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("seed", SEEDS)
def test_polynomials_against_scipy(degree: int, seed: int) -> None:
    """Correlated ranges: the same optimum and covariance as least squares on whitened inverse depths."""
    rng = np.random.default_rng(seed)
    root = rng.normal(0.0, 1.0, (5, 5)) + 3 * np.eye(5)
    x = np.array([-70.0, -35.0, 5.0, 40.0, 60.0])
    points = Points(x, 800.0 + root @ rng.normal(0.0, 1.0, 5), root @ root.T, offset_mm=12.0)
    depth = points.range_mm + 12.0
    whiten = np.linalg.inv(np.linalg.cholesky(points.covariance_mm2 / np.outer(depth**2, depth**2)))

    def residual(c: FloatArray) -> FloatArray:
        model = np.polynomial.polynomial.polyval(x, c) + 12.0
        return np.asarray(whiten @ (1.0 / depth - 1.0 / model))

    scale = 70.0 ** np.arange(degree + 1)
    start = np.zeros(degree + 1)
    start[0] = 800.0
    found = least_squares(residual, start, x_scale=1.0 / scale, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    fit = fit_polynomial(points, degree)
    assert fit is not None
    np.testing.assert_allclose(fit.per_mm(), found.x, rtol=1e-6)
    assert fit.chi2 == pytest.approx(2 * found.cost, rel=1e-6)
    expected = inverse_of_information(found.jac) * np.outer(scale, scale)
    np.testing.assert_allclose(fit.covariance, expected, rtol=1e-4)


def test_the_closest_range_of_a_polynomial_is_at_an_end_or_where_its_slope_is_0() -> None:
    bent = fit_polynomial(seen(X, 400.0 + 0.02 * (X - 10.0) ** 2), 2)
    assert bent is not None
    inside, beside = bent.closest((-60.0, 60.0)), bent.closest((20.0, 60.0))
    assert (inside.x_mm, inside.range_mm) == pytest.approx((10.0, 400.0))
    assert (beside.x_mm, beside.range_mm) == pytest.approx((20.0, 402.0))
    bulging = fit_polynomial(seen(X, 400.0 - 0.02 * (X - 10.0) ** 2), 2)
    assert bulging is not None
    assert bulging.closest((-60.0, 60.0)).x_mm == -60.0
    wavy = fit_polynomial(seen(X, 400.0 + 1e-4 * X * (X - 50.0) * (X + 40.0)), 3)
    assert wavy is not None
    x = np.linspace(-45.0, 60.0, 200_001)
    closest = wavy.closest((-45.0, 60.0))
    assert closest.range_mm == pytest.approx(
        np.polynomial.polynomial.polyval(x, wavy.per_mm()).min(), abs=1e-6
    )


def test_the_deviation_of_the_closest_range_is_that_of_the_coefficients() -> None:
    fit = fit_polynomial(seen(X, incline(500.0, 20.0)(X)), 1)
    assert fit is not None
    closest = fit.closest((-60.0, 60.0))
    row = np.array([1.0, -60.0 / fit.scale_mm])
    assert closest.sigma_mm == pytest.approx(np.sqrt(row @ fit.covariance @ row))
    np.testing.assert_allclose(closest.by_range, row @ fit.by_range)
    # All points farther by 1 mm: so is the closest.
    assert closest.by_range.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_coefficients_are_those_of_powers_of_a_millimetre(degree: int) -> None:
    surface = (flat(500.0), incline(500.0, 10.0), parabola(500.0), cubic(500.0))[degree]
    fit = fit_polynomial(seen(X, surface(X)), degree)
    assert fit is not None
    assert (fit.degree, fit.freedom) == (degree, 3 - degree)
    np.testing.assert_allclose(np.polynomial.polynomial.polyval(X, fit.per_mm()), surface(X), rtol=1e-9)


def test_a_polynomial_behind_the_pinhole_at_a_spot_is_none() -> None:
    x = np.array([-60.0, -25.0, 10.0, 35.0, 60.0])
    points = Points(x, np.array([100.0, 60.0, 20.0, -10.0, -15.0]), np.eye(5), offset_mm=20.0)
    assert [fit_polynomial(points, degree) is None for degree in (0, 1, 2)] == [False, True, False]


def test_ranges_that_determine_no_polynomial_have_none() -> None:
    """Far ones weigh by the inverse of their fourth power: beside a near one nothing is left of them."""
    ranges = np.array([55.0, 9371.0, 871.0, 4964.0, 6407.0, 9155.0])
    points = Points(np.linspace(-57.0, 63.0, 6), ranges, np.diag((0.125 * ranges) ** 2))
    fits = [fit_polynomial(points, degree) for degree in range(6)]
    assert [fit is None for fit in fits] == [False, False, True, True, False, False]
    assert fits[5] is not None
    np.testing.assert_allclose(
        np.polynomial.polynomial.polyval(points.x_mm, fits[5].per_mm()), ranges, rtol=1e-6
    )
