"""Photon-transfer slope measured from residuals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j1

from tests.support.spot_models import ROUND, drawn_windows, pixel_noise
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import FLUX
from workbench.spots.kernels.photon_transfer import measure_variance, shared_grains


@pytest.mark.parametrize("tilted", [False, True])
def test_the_slope_of_the_light_s_variance_is_measured(tilted: bool) -> None:
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    params = np.append(params, [[0.3]], axis=1) if tilted else params
    noise = pixel_noise(4.0, 1.3)
    seeds = range(60)
    fits = [fit_spots(drawn_windows(params, (15, 15), seed), params, noise) for seed in seeds]
    slopes = [fit.noise.slope_dn[0] for fit in fits]
    # The variance of the light was drawn with a slope of 1, the fit starts at 1.3. With some forty telling
    # pixels a window the mean is known to sqrt(2 / 40 / 60) = 2.9 %.
    assert np.mean(slopes) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40 / 60))


def measured(
    contrast2: float, stated_contrast2: float, seed: int, residual_scale: float = 1.0, absorbed: float = 0.0
) -> tuple[float, float]:
    """Slope and squared contrast measured in one window with a floor of 4 DN^2, drawn with 0.5 DN.

    The slope is assumed as 0.5 DN. A fit that absorbs a share of the noise leaves the leverage `absorbed`.
    """
    rng = np.random.default_rng(seed)
    signal = rng.uniform(1.0, 400.0, (1, 60, 60))
    variance = 4.0 + 0.5 * signal + contrast2 * signal**2
    residual = residual_scale * rng.normal(0.0, np.sqrt(variance))
    slope, found = np.full(1, 0.5), np.full(1, stated_contrast2)
    measure_variance(
        signal,
        signal**2,
        residual,
        1.0 / variance,
        absorbed * variance,
        np.full(1, 4.0),
        slope,
        found,
        stated_contrast2,
    )
    return float(slope[0]), float(found[0])


@pytest.mark.parametrize("absorbed", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("stated_contrast2", [0.0, 0.02])
def test_what_the_fit_absorbs_of_the_noise_is_counted(absorbed: float, stated_contrast2: float) -> None:
    """A fit of leverage h leaves residuals whose variance is 1 - h of the pixel's."""
    _, found = measured(0.01, stated_contrast2, 3, np.sqrt(1.0 - absorbed), absorbed)
    # Of 3600 pixels nine of ten are speckle's; the stated contrast counts as four.
    assert found == pytest.approx(0.01, rel=4.5 * np.sqrt(2 / 3000) + 4 / 3000)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_without_speckle_the_contrast_is_next_to_nothing(seed: int) -> None:
    slope, found = measured(0.0, 0.0, seed)
    # Both terms are determined by some thousand pixels each.
    assert slope == pytest.approx(0.5, rel=0.15)
    assert found < 0.5 / 400.0 * 0.15


@pytest.mark.parametrize(("residual_scale", "expected"), [(0.0, 1.0 / 30.0)])
def test_the_slope_stays_within_a_factor_of_thirty(residual_scale: float, expected: float) -> None:
    slope, found = measured(0.0, 0.0, 3, residual_scale)
    assert slope == pytest.approx(0.5 * expected, rel=0.01)
    assert found == 0.0


def test_a_stated_contrast_stands_where_the_spot_is_too_dim_to_measure_it() -> None:
    rng = np.random.default_rng(4)
    signal = rng.uniform(0.0, 2.0, (1, 11, 11))
    slope, found = np.full(1, 0.02), np.full(1, 0.04)
    one = np.ones_like(signal)
    measure_variance(
        signal,
        signal**2,
        rng.normal(0.0, 2.0, signal.shape),
        0.25 * one,
        0.0 * one,
        4.0 * np.ones(1),
        slope,
        found,
        0.04,
    )
    assert found[0] == pytest.approx(0.04, rel=0.1)


@pytest.mark.parametrize("grain_px", [0.1, 0.1733, 0.3])
def test_grains_on_the_border_of_pixels_raise_the_variance_of_sums(grain_px: float) -> None:
    """Against the integral of the autocorrelation of speckle behind a round pupil, over two pixels."""
    edge = np.linspace(0.0, 1.0, 801) ** 1.5
    x, width = 0.5 * (edge[1:] + edge[:-1]), np.diff(edge)
    z = np.pi * np.hypot(x[:, None], x) / grain_px
    by_area = 4.0 * (2.0 * j1(z) / z) ** 2 * np.outer(width, width)
    contrast2 = float((by_area * np.outer(1.0 - x, 1.0 - x)).sum())
    of_all = 4.0 / np.pi * grain_px**2
    assert shared_grains(contrast2) == pytest.approx(of_all / contrast2, rel=0.01)
