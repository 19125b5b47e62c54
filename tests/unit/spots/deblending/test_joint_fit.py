"""Deviations of two spots that are fitted together: the second order, and the inverse behind them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from workbench.spots.deblending.joint_fit import fit_joint
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, LN_SV, SHEAR, U, V
from workbench.spots.kernels.joint_sums import add_pairs, leverages, profiles, sums_alone
from workbench.spots.kernels.single_sums import invert
from workbench.spots.noise import Noise
from workbench.spots.psf import derivatives

WIDTH, HALF, APART, TOLD = 2.5, 12, 3.0, 400.0
SHAPE = (2 * HALF + 1, 2 * HALF + 1)
PAIRS = 500


def two_spots(rng: np.random.Generator) -> np.ndarray:
    """(2, 6) true parameters, three widths apart, in noise of 1 DN."""
    true = np.zeros((2, 6))
    true[:, FLUX], true[:, LN_SU:] = np.sqrt(TOLD * 4.0 * np.pi) * WIDTH, np.log(WIDTH)
    true[:, U] = HALF + rng.uniform(-0.5, 0.5) + np.array([-0.5, 0.5]) * APART * WIDTH
    true[:, U + 1] = HALF + rng.uniform(-0.5, 0.5)
    return true


def jacobian_of(params: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(3 + 3 k, pixels): by background, both widths, then flux, u and v of each spot; every pixel."""
    rows = derivatives(params, shape).reshape(*params.shape, -1)
    rows[:, U:] *= params[:, FLUX, None, None]
    own = rows[:, [FLUX, U, V]].reshape(-1, rows.shape[2])
    return np.concatenate([rows[:1, 0], rows[:, LN_SU:SHEAR].sum(axis=0), own])


@pytest.mark.parametrize("k", [1, 2, 4])
def test_the_sums_of_a_joint_fit_are_those_of_its_derivatives(k: int) -> None:
    rng, shape = np.random.default_rng(k), (25, 31)
    params = np.zeros((k, 6))
    params[:, FLUX] = rng.uniform(100.0, 5000.0, k)
    # Two that overlap, one that the border of the window cuts, one by itself.
    params[:, U] = (12.3, 15.1, 30.4, 4.0)[:k]
    params[:, V] = (11.8, 13.0, 1.2, 24.6)[:k]
    params[:, LN_SU], params[:, LN_SV] = np.log(1.1), np.log(1.7)
    weight, residual = rng.uniform(0.0, 1.0, shape), rng.normal(0.0, 3.0, shape)
    weight[rng.uniform(size=shape) < 0.2] = 0.0
    dense = jacobian_of(params, shape)
    m = len(dense)
    along_u, along_v, box = np.empty((k, 4, shape[1])), np.empty((k, 4, shape[0])), np.empty((k, 4), np.intp)
    information, gradient, leverage = np.empty((m, m)), np.empty(m), np.empty(shape)
    profiles(params, along_u, along_v, box)
    sums_alone(params, along_u, along_v, box, weight, residual, information, gradient)
    add_pairs(params, along_u, along_v, box, weight, information)
    expected = (dense * weight.ravel()) @ dense.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Light beyond five widths is left out: a millionth, which a derivative by the width weighs by z^2.
    np.testing.assert_allclose(information / scale, expected / scale, atol=1e-5)
    pulled = dense @ (weight * residual).ravel()
    np.testing.assert_allclose((gradient - pulled) / np.sqrt(np.diag(expected)), 0.0, atol=1e-4)
    root = rng.normal(size=(m, 2 * m))
    cov = root @ root.T / scale
    leverages(params, along_u, along_v, box, cov, leverage)
    theirs = ((cov @ dense) * dense).sum(axis=0).reshape(shape)
    np.testing.assert_allclose(leverage, theirs, atol=1e-5 * theirs.max())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spots_that_start_with_shapes_of_their_own_end_with_one(seed: int) -> None:
    """The optimum, the deviations and the sum of squares are those of scipy's."""
    rng, shape = np.random.default_rng(seed), (25, 31)
    true = np.zeros((3, 6))
    true[:, FLUX], true[:, 0] = (3000.0, 2000.0, 2500.0), 1.5
    true[:, U], true[:, V] = (9.3, 14.1, 20.4), (11.8, 13.0, 10.2)
    true[:, LN_SU], true[:, LN_SV] = np.log(1.6), np.log(1.9)

    def of(x: np.ndarray) -> np.ndarray:
        params = np.zeros((3, 6))
        params[:, 0], params[:, LN_SU:] = x[0], x[1:3]
        params[:, FLUX:LN_SU] = x[3:].reshape(3, 3)
        return params

    def light(params: np.ndarray) -> np.ndarray:
        jacobian = jacobian_of(params, shape)
        return np.asarray(params[0, 0] + params[:, FLUX] @ jacobian[3::3])

    data = light(true) + rng.normal(0.0, 2.0, shape[0] * shape[1])
    start = true + rng.normal(0.0, 0.1, true.shape) * (1.0, 1000.0, 1.0, 1.0, 1.0, 1.0)
    first = np.concatenate([start[0, [0, LN_SU, LN_SV]], start[:, FLUX:LN_SU].ravel()])

    def misfit(x: np.ndarray) -> np.ndarray:
        return (light(of(x)) - data) / 2.0

    theirs = least_squares(misfit, first, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    win = Windows(data.reshape(1, *shape), np.ones((1, *shape), bool), np.full((1, *shape), np.inf))
    ours = fit_joint(win, start, Noise(np.full(1, 4.0), np.full(1, 1e-12)))
    assert ours.converged
    assert (ours.params[:, LN_SU:] == ours.params[0, LN_SU:]).all()
    assert (ours.params[:, 0] == ours.params[0, 0]).all()
    expected, jacobian = of(theirs.x), np.asarray(theirs.jac)
    cov = np.linalg.inv(jacobian.T @ jacobian)
    sd = np.sqrt(np.diag(cov)[3:]).reshape(3, 3)
    # The steps stop within a tenth of a deviation, and the last one that is taken squares what is left.
    assert (np.abs((ours.params - expected)[:, FLUX:LN_SU]) < 0.03 * sd).all()
    np.testing.assert_allclose(ours.sd, sd, rtol=0.02)
    assert ours.chi2 == pytest.approx(2.0 * theirs.cost, rel=1e-3)


def test_a_start_that_is_no_number_does_not_converge() -> None:
    start = np.zeros((2, 6))
    start[:, FLUX], start[:, U], start[:, V] = 500.0, (5.0, np.nan), 6.0
    win = Windows(np.zeros((1, 13, 13)), np.ones((1, 13, 13), bool), np.full((1, 13, 13), np.inf))
    assert not fit_joint(win, start, Noise(np.ones(1), np.ones(1))).converged


def test_the_deviations_of_spots_fitted_together_are_right_to_second_order() -> None:
    rng = np.random.default_rng(1)
    white = Noise(np.ones(1), np.full(1, 1e-9))
    terms = []
    for _ in range(PAIRS):
        true = two_spots(rng)
        jacobian = jacobian_of(true, SHAPE)
        signal = true[:, FLUX] @ jacobian[3::3]
        cov = np.linalg.inv(jacobian @ jacobian.T)
        noise = rng.normal(0.0, 1.0, signal.size)
        first = ((cov @ (jacobian @ noise)) ** 2 / np.diag(cov))[3:].reshape(2, 3)[:, 1:]
        for sign in (1.0, -1.0):
            data = (signal + sign * noise).reshape(1, *SHAPE)
            win = Windows(data, np.ones_like(data, bool), np.full_like(data, np.inf))
            found = fit_joint(win, true, white)
            assert found.converged
            terms.append(((found.params - true)[:, U:LN_SU] / found.sd[:, 1:]) ** 2 - first)
    # The error to first order has z of variance 1 exactly, and an even part that opposite noise cancels.
    excess = np.array(terms).reshape(PAIRS, 2, 2, 2).mean(axis=1).mean(axis=(1, 2))
    sampling = 4.0 * excess.std() / np.sqrt(PAIRS)
    # Left out, the term is some 10 / 400.
    assert sampling < 0.4 * 10.0 / TOLD
    assert excess.mean() == pytest.approx(0.0, abs=sampling)


@pytest.mark.parametrize("k", [6, 7, 9, 18])
def test_the_inverse_is_that_of_linear_algebra(k: int) -> None:
    rng = np.random.default_rng(k)
    root = rng.normal(size=(k, 3 * k)) * np.logspace(-1, 3, k)[:, None]
    matrix, found = root @ root.T, np.empty((k, k))
    theirs = np.linalg.inv(matrix)
    invert(matrix, found)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    np.testing.assert_allclose(found / scale, theirs / scale, atol=1e-7)


def test_two_spots_at_one_place_have_a_finite_inverse() -> None:
    found = np.empty((2, 2))
    invert(np.ones((2, 2)), found)
    assert np.isfinite(found).all()
