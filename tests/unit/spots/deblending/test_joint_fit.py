"""Deviations of two spots that are fitted together: the second order, and the inverse behind them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.spot_models import jacobian_of, pixel_noise
from workbench.spots.deblending.joint_fit import fit_joint, pair_guess
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, LN_SV, U, V

WIDTH, HALF, APART, INFORMATION = 2.5, 12, 3.0, 400.0


SHAPE = (2 * HALF + 1, 2 * HALF + 1)


PAIRS = 500


def two_spots(rng: np.random.Generator) -> np.ndarray:
    """(2, 6) true parameters, three widths apart, in noise of 1 DN."""
    true = np.zeros((2, 6))
    true[:, FLUX], true[:, LN_SU:] = np.sqrt(INFORMATION * 4.0 * np.pi) * WIDTH, np.log(WIDTH)
    true[:, U] = HALF + rng.uniform(-0.5, 0.5) + np.array([-0.5, 0.5]) * APART * WIDTH
    true[:, U + 1] = HALF + rng.uniform(-0.5, 0.5)
    return true


@pytest.mark.parametrize("apart_px", [2.0, 5.0])
@pytest.mark.parametrize(("along", "across"), [(U, V), (V, U)])
def test_two_like_spots_are_guessed_from_the_widths_of_their_sum(
    along: int, across: int, apart_px: float
) -> None:
    """Two halves at both sides of the middle add the square of their distance from it to the variance."""
    summed = np.array([3.0, 1000.0, 0.0, 0.0, np.log(1.4), np.log(1.4)])
    summed[[along, across]] = 20.0, 30.0
    summed[LN_SU + along - U] = 0.5 * np.log(1.4**2 + apart_px**2)
    start = pair_guess(summed)
    assert sorted(start[:, along].tolist()) == pytest.approx([20.0 - apart_px, 20.0 + apart_px])
    np.testing.assert_allclose(start[:, across], 30.0)
    np.testing.assert_allclose(start[:, FLUX], 500.0)
    np.testing.assert_allclose(np.exp(start[:, LN_SU:]), 1.4)


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
    ours = fit_joint(win, start, pixel_noise(4.0, 1e-12))
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
    assert not fit_joint(win, start, pixel_noise(1.0, 1.0)).converged


def test_the_deviations_of_spots_fitted_together_are_right_to_second_order() -> None:
    rng = np.random.default_rng(1)
    white = pixel_noise(1.0, 1e-9)
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
    assert sampling < 0.4 * 10.0 / INFORMATION
    assert excess.mean() == pytest.approx(0.0, abs=sampling)
