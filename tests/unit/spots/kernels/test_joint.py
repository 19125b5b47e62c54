"""Fisher scoring of spots that share their widths: fixed weights, one spot, leverage, steps at the limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.spot_models import jacobian_of, pixel_noise
from workbench.model.arrays import FloatArray
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.columns import BACKGROUND, FLUX, LN_SU, LN_SV, U, V
from workbench.spots.kernels.joint import joint_fisher_scoring

SHAPE = (21, 27)
FLOOR, SLOPE = 4.0, 0.5


class Scored(NamedTuple):
    converged: bool
    params: FloatArray
    cov: FloatArray
    by_noise: FloatArray
    signal: FloatArray
    mean_square: FloatArray
    residual: FloatArray
    weight: FloatArray
    leverage: FloatArray


def scored(
    data: FloatArray, start: FloatArray, weight: FloatArray | None = None, contrast2: float = 0.0
) -> Scored:
    m = 3 + 3 * len(start)
    params, cov, by_noise = start.copy(), np.empty((m, m)), np.zeros((len(start), 2))
    signal, mean_square, residual, leverage = (np.empty(SHAPE) for _ in range(4))
    used = np.empty(SHAPE) if weight is None else weight.copy()
    filled = (params, cov, by_noise, signal, mean_square, residual, used, leverage)
    usable, fixed = np.ones(SHAPE, bool), weight is not None
    converged = joint_fisher_scoring(data, usable, FLOOR, SLOPE, contrast2, fixed, *filled)
    return Scored(converged, *filled)


def spots_of(*places: tuple[float, float]) -> FloatArray:
    """(k, 6) on a background of 2 DN."""
    return np.array([[2.0, 3000.0, u, v, np.log(1.5), np.log(1.8)] for u, v in places])


def light(params: FloatArray) -> FloatArray:
    rows = jacobian_of(params, SHAPE)
    return np.asarray(params[0, BACKGROUND] + params[:, FLUX] @ rows[3::3]).reshape(SHAPE)


def drawn(params: FloatArray, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    expected = light(params)
    return rng.normal(expected, np.sqrt(FLOOR + SLOPE * (expected - params[0, BACKGROUND])))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_with_fixed_weights_it_is_weighted_least_squares(seed: int) -> None:
    true = spots_of((10.2, 9.8), (15.1, 11.3))
    data = drawn(true, seed)
    weight = np.random.default_rng(seed).uniform(0.05, 0.5, SHAPE)

    def params_of(x: FloatArray) -> FloatArray:
        params = np.empty((2, 6))
        params[:, BACKGROUND], params[:, LN_SU:] = x[0], x[1:3]
        params[:, FLUX:LN_SU] = x[3:].reshape(2, 3)
        return params

    def misfit(x: FloatArray) -> FloatArray:
        return np.asarray((np.sqrt(weight) * (light(params_of(x)) - data)).ravel())

    start = np.concatenate([[2.0], true[0, LN_SU:], true[:, FLUX:LN_SU].ravel()])
    theirs = least_squares(misfit, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    ours = scored(data, true, weight)
    assert ours.converged
    sd = np.sqrt(np.diag(ours.cov))
    found = np.concatenate(
        [ours.params[0, [BACKGROUND, LN_SU, LN_SU + 1]], ours.params[:, FLUX:LN_SU].ravel()]
    )
    # The steps stop within a tenth of a deviation, and the last one that is taken squares what is left.
    assert (np.abs(found - theirs.x) < 0.03 * sd).all()
    np.testing.assert_array_equal(ours.weight, weight)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_spot_alone_is_fitted_as_by_itself(seed: int) -> None:
    true = spots_of((13.3, 9.7))
    data = drawn(true, seed)
    win = Windows(data[None], np.ones((1, *SHAPE), bool), np.full((1, *SHAPE), np.inf))
    alone = fit_spots(win, true, pixel_noise(FLOOR, SLOPE))
    # That one measures the slope of its noise; with the same weights the two are one.
    joint = scored(data, true, alone.weight[0])
    sd = np.sqrt(np.diag(joint.cov))
    order = [BACKGROUND, LN_SU, LN_SV, FLUX, U, V]
    assert (np.abs(joint.params[0, order] - alone.params[0, order]) < 0.03 * sd).all()


def test_the_leverage_of_all_pixels_is_the_number_of_parameters() -> None:
    """Trace of the projection that least squares is."""
    true = spots_of((8.2, 9.8), (14.1, 11.3), (19.0, 6.0))
    found = scored(drawn(true, 4), true)
    assert found.converged
    assert (found.leverage * found.weight).sum() == pytest.approx(3 + 3 * 3, rel=1e-4)
    variance = FLOOR + SLOPE * np.maximum(found.signal, 0.0)
    np.testing.assert_allclose(found.weight, 1.0 / variance, rtol=1e-12)


def test_a_step_moves_no_spot_out_of_its_place_at_once() -> None:
    """Two pixels off it takes several steps of 0.7 px each, and arrives."""
    true = spots_of((10.0, 10.0))
    start = spots_of((12.0, 10.0))
    found = scored(light(true), start)
    assert found.converged
    assert found.params[0, [U, V]] == pytest.approx([10.0, 10.0], abs=1e-3)


def test_the_variance_by_noise_is_that_of_the_sandwich_formula() -> None:
    true, contrast2 = spots_of((8.2, 9.8), (14.1, 11.3)), 0.03
    found = scored(light(true), true, contrast2=contrast2)
    assert found.converged
    jacobian, by_noise = jacobian_of(true, SHAPE), FLOOR + SLOPE * np.maximum(found.signal, 0.0)
    variance = by_noise + contrast2 * found.mean_square
    np.testing.assert_allclose(found.weight, 1.0 / variance, rtol=1e-12)
    cov = np.linalg.inv((jacobian / variance.ravel()) @ jacobian.T)
    sandwich = cov @ (jacobian * (by_noise / variance**2).ravel()) @ jacobian.T @ cov
    np.testing.assert_allclose(found.by_noise.ravel(), np.diag(sandwich)[[4, 5, 7, 8]], rtol=1e-4)


def test_the_speckle_of_two_lasers_adds_in_squares() -> None:
    """They do not interfere: where both light a pixel evenly, its variance is the sum of both."""
    wide = np.array([[0.0, 9e4, 13.0, 10.0, np.log(8.0), np.log(8.0)]])
    one = scored(light(wide), wide)
    two = scored(light(np.vstack([wide, wide])), np.vstack([wide, wide]))
    np.testing.assert_allclose(two.mean_square, 2.0 * one.mean_square, rtol=0.01)
    np.testing.assert_allclose(one.mean_square, one.signal**2, rtol=0.02)
