"""Sums of a fit of one spot, and the inverse of its matrix, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.kernels.profiles import profile, sheared_rows, upright_rows
from workbench.spots.kernels.single_sums import dense_sums, fill_leverage, invert, separable_sums


@pytest.mark.parametrize("k", [6, 7, 9, 18])
def test_the_inverse_is_that_of_linear_algebra(k: int) -> None:
    rng = np.random.default_rng(k)
    root = rng.normal(size=(k, 3 * k)) * np.logspace(-1, 3, k)[:, None]
    matrix, found = root @ root.T, np.empty((k, k))
    theirs = np.linalg.inv(matrix)
    invert(matrix, found)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    np.testing.assert_allclose(found / scale, theirs / scale, atol=1e-7)


def test_a_small_pivot_is_exchanged_for_a_larger_one() -> None:
    found = np.empty((2, 2))
    invert(np.array([[0.0, 2.0], [4.0, 1.0]]), found)
    np.testing.assert_allclose(found @ np.array([[0.0, 2.0], [4.0, 1.0]]), np.eye(2), atol=1e-9)


def test_two_spots_at_one_place_have_a_finite_inverse() -> None:
    found = np.empty((2, 2))
    invert(np.ones((2, 2)), found)
    assert np.isfinite(found).all()


UPRIGHT = np.array([0.0, 1.0, 6.3, 5.8, np.log(1.1), np.log(1.7)])
SHAPE = (12, 14)


def weights_and_residuals(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    weight = rng.uniform(0.0, 1.0, SHAPE)
    weight[rng.random(SHAPE) < 0.2] = 0.0
    return weight, rng.normal(0.0, 3.0, SHAPE)


@pytest.mark.parametrize("seed", [1, 2])
def test_sums_of_an_upright_spot_are_those_of_its_derivatives(seed: int) -> None:
    rows, along_u, along_v = np.empty((6, *SHAPE)), np.empty((4, SHAPE[1])), np.empty((4, SHAPE[0]))
    upright_rows(UPRIGHT, rows)
    profile(UPRIGHT[2], UPRIGHT[4], along_u)
    profile(UPRIGHT[3], UPRIGHT[5], along_v)
    weight, residual = weights_and_residuals(seed)
    information, gradient = np.empty((6, 6)), np.empty(6)
    separable_sums(along_u, along_v, weight, residual, information, gradient)
    flat = rows.reshape(6, -1)
    np.testing.assert_allclose(information, (flat * weight.ravel()) @ flat.T, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(gradient, flat @ (weight * residual).ravel(), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_sums_of_a_sheared_spot_and_its_leverage_are_those_of_numpy(seed: int) -> None:
    rows = np.empty((7, *SHAPE))
    sheared_rows(np.append(UPRIGHT, 0.3), rows)
    weight, residual = weights_and_residuals(seed)
    information, gradient, leverage = np.empty((7, 7)), np.empty(7), np.empty(SHAPE)
    dense_sums(rows, weight, residual, information, gradient)
    flat = rows.reshape(7, -1)
    np.testing.assert_allclose(information, (flat * weight.ravel()) @ flat.T, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(gradient, flat @ (weight * residual).ravel(), rtol=1e-9, atol=1e-12)
    cov = np.asarray(np.linalg.inv(information), np.float64)
    fill_leverage(rows, cov, leverage)
    np.testing.assert_allclose(leverage, np.einsum("iyx,ij,jyx->yx", rows, cov, rows), rtol=1e-9)
    # Trace of the projection that least squares is.
    assert (leverage * weight).sum() == pytest.approx(7.0)
