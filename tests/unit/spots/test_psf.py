"""The model of a spot against quadrature and differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from tests.support.draw import Drawn, profile
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.columns import BACKGROUND, FLUX, LN_SU, SHEAR, U
from workbench.spots.kernels.profiles import profile as axis_profiles
from workbench.spots.noise import Noise
from workbench.spots.psf import derivatives, principal_axes

SHAPE = (15, 15)
ROUND = np.array([[0.0, 1.0, 7.3, 6.8, np.log(1.1), np.log(1.7)]])


@pytest.mark.parametrize("sd", [0.3, 0.6, 1.5, 4.0])
def test_share_of_a_pixel_is_the_integral_of_the_density(sd: float) -> None:
    profiles = np.empty((4, 8))
    axis_profiles(3.2, float(np.log(sd)), profiles)
    shares = profiles[0]
    for pixel, share in enumerate(shares):
        whole, _ = quad(norm(3.2, sd).pdf, pixel - 0.5, pixel + 0.5, epsabs=1e-13)
        assert share == pytest.approx(whole, abs=1e-11)


@pytest.mark.parametrize("params", [ROUND, np.append(ROUND, [[0.4]], axis=1)], ids=["upright", "sheared"])
def test_derivatives_are_those_of_the_unit_spot(params: np.ndarray) -> None:
    rows = derivatives(params, SHAPE)[0]
    step = 1e-5
    for k in range(2, params.shape[1]):
        up, down = params.copy(), params.copy()
        up[0, k] += step
        down[0, k] -= step
        difference = (derivatives(up, SHAPE)[0, FLUX] - derivatives(down, SHAPE)[0, FLUX]) / (2 * step)
        np.testing.assert_allclose(rows[k], difference, atol=1e-9)


def drawn_windows(params: np.ndarray, shape: tuple[int, int], seed: int = 1) -> Windows:
    rng = np.random.default_rng(seed)
    light = params[:, FLUX, None, None] * derivatives(params, shape)[:, FLUX]
    data = rng.normal(light, np.sqrt(4.0 + np.maximum(light, 0.0)))
    return Windows(data, rng.random(data.shape) < 0.95, np.full(data.shape, np.inf))


@pytest.mark.parametrize("tilted", [False, True])
def test_the_fit_solves_its_equations_as_the_written_out_sums_state_them(tilted: bool) -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    if tilted:
        params = np.append(params, [[0.3], [-0.2]], axis=1)
    win = drawn_windows(params, (11, 13))
    # Fitted from its own end once more, the model moves by less than the step's tolerance.
    start = fit_spots(win, params, Noise(np.full(2, 4.0), np.ones(2))).params
    fit = fit_spots(win, start, Noise(np.full(2, 4.0), np.ones(2)))
    assert fit.converged.all()
    rows = derivatives(start, (11, 13)).reshape(2, params.shape[1], -1)
    signal = start[:, FLUX, None] * rows[:, FLUX]
    weight = win.usable.reshape(2, -1) / (4.0 + fit.slope_dn[:, None] * np.maximum(signal, 0.0))
    information = (rows * weight[:, None]) @ rows.transpose(0, 2, 1)
    residual = win.data.reshape(2, -1) - signal - start[:, BACKGROUND, None]
    step = np.linalg.solve(information, rows @ (weight * residual)[:, :, None])[:, :, 0]
    step[:, U:] /= start[:, FLUX, None]
    np.testing.assert_allclose(fit.params, start + step, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(fit.cov, np.linalg.inv(information), rtol=1e-4)


@pytest.mark.parametrize("tilted", [False, True])
def test_the_slope_of_the_light_s_variance_is_measured(tilted: bool) -> None:
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    params = np.append(params, [[0.3]], axis=1) if tilted else params
    noise = Noise(np.array([4.0]), np.array([1.3]))
    seeds = range(60)
    slopes = [fit_spots(drawn_windows(params, (15, 15), seed), params, noise).slope_dn[0] for seed in seeds]
    # The variance of the light was drawn with a slope of 1, the fit starts at 1.3. With some forty telling
    # pixels a window the mean is known to sqrt(2 / 40 / 60) = 2.9 %.
    assert np.mean(slopes) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40 / 60))


def test_sheared_without_shear_is_upright() -> None:
    # Three quadrature nodes a pixel: exact to 1e-4 of the peak at a width of 0.6 px.
    params = np.array([[0.0, 1.0, 7.3, 6.8, np.log(0.6), np.log(0.6), 0.0]])
    upright, sheared = (derivatives(p, SHAPE)[:, FLUX] for p in (params[:, :SHEAR], params))
    np.testing.assert_allclose(sheared, upright, atol=2e-4 * upright.max())


@pytest.mark.parametrize("angle", [0.5, -0.9, 1.3])
def test_sheared_describes_a_turned_ellipse(angle: float) -> None:
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    covariance = turn @ np.diag([2.0**2, 1.2**2]) @ turn.T
    shear = covariance[0, 1] / covariance[1, 1]
    su = np.sqrt(covariance[0, 0] - shear * covariance[0, 1])
    params = np.array([[0.0, 1.0, 7.2, 6.9, np.log(su), 0.5 * np.log(covariance[1, 1]), shear]])
    drawn = profile(SHAPE, Drawn(7.2, 6.9, 1.0, 2.0, 1.2, angle))
    np.testing.assert_allclose(derivatives(params, SHAPE)[0, FLUX], drawn, atol=2e-3 * drawn.max())
    widths, axes = principal_axes(params[0])
    np.testing.assert_allclose(widths, [1.2, 2.0], rtol=1e-9)
    assert abs(axes[:, 1] @ (cos, sin)) == pytest.approx(1.0)
    assert params[0, LN_SU] < np.log(2.0)
