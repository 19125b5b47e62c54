"""Photon-transfer slope measured from residuals."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.spot_models import ROUND, drawn_windows
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import FLUX
from workbench.spots.kernels.photon_transfer import transfer_slope
from workbench.spots.noise import PixelNoise


@pytest.mark.parametrize("tilted", [False, True])
def test_the_slope_of_the_light_s_variance_is_measured(tilted: bool) -> None:
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    params = np.append(params, [[0.3]], axis=1) if tilted else params
    noise = PixelNoise(np.array([4.0]), np.array([1.3]))
    seeds = range(60)
    slopes = [fit_spots(drawn_windows(params, (15, 15), seed), params, noise).slope_dn[0] for seed in seeds]
    # The variance of the light was drawn with a slope of 1, the fit starts at 1.3. With some forty telling
    # pixels a window the mean is known to sqrt(2 / 40 / 60) = 2.9 %.
    assert np.mean(slopes) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40 / 60))


def slope_of(residual_scale: float, absorbed: float, assumed: float) -> float:
    """Slope measured in one window of noise with a floor of 4 DN^2 and a slope of 0.5 DN, scaled."""
    rng = np.random.default_rng(3)
    signal = rng.uniform(20.0, 400.0, (1, 60, 60))
    variance = 4.0 + 0.5 * signal
    residual = residual_scale * rng.normal(0.0, np.sqrt(variance))
    floor = np.full(1, 4.0)
    found = transfer_slope(signal, residual, 1.0 / variance, absorbed * variance, floor, np.full(1, assumed))
    return float(found[0])


@pytest.mark.parametrize("absorbed", [0.0, 0.2, 0.5])
def test_what_the_fit_absorbs_of_the_noise_is_counted(absorbed: float) -> None:
    """A fit of leverage h leaves residuals whose variance is 1 - h of the pixel's."""
    found = slope_of(np.sqrt(1.0 - absorbed), absorbed, 0.5)
    assert found == pytest.approx(0.5, rel=4.5 * np.sqrt(2 / 3600))


@pytest.mark.parametrize(("residual_scale", "expected"), [(100.0, 30.0), (0.0, 1.0 / 30.0)])
def test_the_slope_stays_within_a_factor_of_thirty(residual_scale: float, expected: float) -> None:
    assert slope_of(residual_scale, 0.0, 0.5) == pytest.approx(0.5 * expected, rel=0.01)
