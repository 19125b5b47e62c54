"""The compiled fits of polynomials and circles: normal equations, derivatives, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.support.surfaces import cylinder, parabola
from workbench.model.arrays import FloatArray
from workbench.ranging.shape_kernels import circle, invert, polynomial, polynomials

X = np.array([-60.0, -25.0, 10.0, 35.0, 60.0])
OFFSET_MM = 20.0


def covariances(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of ranges, of places, and of both: all with entries off the diagonal."""
    root = np.random.default_rng(seed).normal(0.0, 0.1, (10, 20))
    whole = root @ root.T
    ranges, places, cross = (np.ascontiguousarray(p) for p in (whole[:5, :5], whole[5:, 5:], whole[:5, 5:]))
    return ranges, places, cross


def fitted(
    x: FloatArray, ranges: FloatArray, degree: int, seed: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float, FloatArray, FloatArray]:
    return polynomial(x, degree, 60.0, ranges, OFFSET_MM, *covariances(seed), 12)


@pytest.mark.parametrize("size", [1, 2, 4, 6])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_inverse_and_determinant_are_those_of_numpy(size: int, seed: int) -> None:
    matrix = np.random.default_rng(seed).normal(0.0, 1.0, (size, size))
    out = np.empty((size, size))
    assert invert(matrix.copy(), out) == pytest.approx(np.linalg.slogdet(matrix)[1], abs=1e-9)
    np.testing.assert_allclose(out, np.linalg.inv(matrix), rtol=1e-9, atol=1e-9)


def test_a_singular_matrix_has_no_inverse() -> None:
    out = np.empty((2, 2))
    assert math.isnan(invert(np.ones((2, 2)), out))
    assert np.isnan(out).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_fits_of_all_degrees_are_those_of_each(seed: int) -> None:
    ranges = parabola(500.0)(X) + np.random.default_rng(seed).normal(0.0, 0.3, 5)
    together = polynomials(X, 4, 60.0, ranges, OFFSET_MM, *covariances(seed), 12)
    for degree in range(4):
        for stack, alone in zip(together, map(np.asarray, fitted(X, ranges, degree, seed)), strict=True):
            own = stack[degree][tuple(slice(0, size) for size in alone.shape)]
            np.testing.assert_array_equal(own, alone)
            assert np.count_nonzero(stack[degree]) == np.count_nonzero(own)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_gradient_of_a_polynomial_s_misfit_vanishes(degree: int, seed: int) -> None:
    """With the weights of the whole covariance, through the slope where a place errs."""
    ranges = parabola(500.0)(X) + np.random.default_rng(seed).normal(0.0, 0.3, 5)
    coefficients, covariance, _, _, chi2, _, stated_weight = fitted(X, ranges, degree, seed)
    powers = np.vander(X / 60.0, degree + 1, increasing=True)
    depth, measured = powers @ coefficients + OFFSET_MM, ranges + OFFSET_MM
    slope = powers[:, :-1] @ (coefficients[1:] * np.arange(1, degree + 1)) / 60.0
    of_range, of_place = -np.diag(1.0 / measured**2), np.diag(slope / measured**2)
    c, p, cross = covariances(seed)
    both = np.block([of_range, of_place])
    weight = np.linalg.inv(both @ np.block([[c, cross], [cross.T, p]]) @ both.T)
    residual, by = 1.0 / depth - 1.0 / measured, powers / depth[:, None] ** 2
    gradient = by.T @ weight @ residual
    sd = np.sqrt(np.diag(np.linalg.inv(by.T @ weight @ by)))
    assert np.abs(gradient * sd).max() < 1e-4
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sd, rtol=1e-5)
    assert chi2 == pytest.approx(residual @ weight @ residual, rel=1e-4)
    np.testing.assert_allclose(stated_weight, weight, rtol=1e-3)


def test_derivatives_of_a_polynomial_are_those_of_differences() -> None:
    """Of exact points: where the residuals vanish the weights, which move as well, do not matter."""
    ranges, step = parabola(500.0)(X), 1e-3
    _, _, by_range, by_place, chi2, _, _ = fitted(X, ranges, 2, 1)
    assert chi2 < 1e-12
    for n, change in enumerate(step * np.eye(5)):
        ahead, back = (fitted(X, ranges + sign * change, 2, 1)[0] for sign in (1, -1))
        np.testing.assert_allclose(by_range[:, n], (ahead - back) / (2 * step), atol=1e-4)
        ahead, back = (fitted(X + sign * change, ranges, 2, 1)[0] for sign in (1, -1))
        np.testing.assert_allclose(by_place[:, n], (ahead - back) / (2 * step), atol=1e-4)


def circled(ranges: FloatArray, x: FloatArray = X) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    start = np.array([3.0, 400.0, 90.0])
    return circle(start, x, ranges, *covariances(1), 30, 0.1, 1e5)


def test_a_circle_through_exact_points_is_the_one_that_made_them() -> None:
    found, covariance, by_range, chi2, _ = circled(cylinder(300.0, 12.0)(X))
    assert found == pytest.approx([12.0, 389.0, 89.0], abs=1e-6)
    assert chi2 == pytest.approx(0.0, abs=1e-9)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    # All points farther by 1 mm: so is the axis, and nothing else.
    np.testing.assert_allclose(by_range.sum(axis=1), [0.0, 1.0, 0.0], atol=1e-9)


def test_derivatives_of_a_circle_are_those_of_differences() -> None:
    ranges, step = cylinder(300.0, 12.0)(X), 1e-3
    by_range = circled(ranges)[2]
    for n, change in enumerate(step * np.eye(5)):
        ahead, back = (circled(ranges + sign * change)[0] for sign in (1, -1))
        np.testing.assert_allclose(by_range[:, n], (ahead - back) / (2 * step), atol=2e-3)


def test_what_cannot_be_has_no_chi2() -> None:
    """A circle seen from its far side, and a polynomial behind the pinhole at a point."""
    assert math.isnan(circled(700.0 - cylinder(300.0, 12.0)(X))[3])
    steep, none = np.array([100.0, 60.0, 20.0, -10.0, -15.0]), np.zeros((5, 5))
    chi2 = [
        polynomial(X, degree, 60.0, steep, OFFSET_MM, np.eye(5), none, none, 3)[4] for degree in (0, 1, 2)
    ]
    assert [math.isfinite(value) for value in chi2] == [True, False, True]
