"""Level, variance and photon-transfer slope estimated from simulated noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.spot_models import pixel_noise
from workbench.model.arrays import FloatArray
from workbench.spots.kernels.photon_transfer import measure_variance
from workbench.spots.noise import (
    ROUNDING_DN2,
    PixelNoise,
    level_and_variance,
    stated_contrast2,
)

SAMPLES = 1200
"""Pixels that the estimate is taken from, in a strip of many more."""
STRIPS = 40


@pytest.mark.parametrize(("sd", "level"), [(0.6, 0.0), (3.0, -7.3), (40.0, 200.4)])
def test_level_and_variance_of_rounded_noise_are_found_among_spots(sd: float, level: float) -> None:
    rng = np.random.default_rng(5)
    found = []
    for _ in range(STRIPS):
        strip = np.rint(rng.normal(level, sd, (40, 317)))
        strip[rng.random(strip.shape) < 0.03] += 50.0 * sd
        found.append(level_and_variance(strip.astype(np.float32)))
    levels, variances = np.array(found).T
    true = sd**2 + ROUNDING_DN2
    n = SAMPLES * STRIPS
    assert levels.mean() == pytest.approx(level, abs=4 * np.sqrt(true / n) + 0.02)
    # Cutting a Gaussian at 4 sd takes a thousandth of its variance.
    assert variances.mean() == pytest.approx(true, rel=4 * np.sqrt(2 / n) + 2e-3)


def test_an_even_frame_has_the_variance_of_rounding() -> None:
    level, variance = level_and_variance(np.full((30, 50), 17.0, np.float32))
    assert (level, variance) == (17.0, ROUNDING_DN2)


def drawn(slope: float, contrast2: float, seed: int, windows: int = 6) -> tuple[FloatArray, ...]:
    """Signal, its square, residual and inverse variance of windows with a floor of 4 DN^2."""
    rng = np.random.default_rng(seed)
    x = np.arange(21) - 10.0
    shape = np.exp(-0.5 * (x[:, None] ** 2 + x**2) / 4.0**2)
    signal = rng.uniform(200.0, 400.0, (windows, 1, 1)) * shape
    variance = 4.0 + slope * signal + contrast2 * signal**2
    return signal, signal**2, rng.normal(0.0, np.sqrt(variance)), 1.0 / variance


def measured(windows: tuple[FloatArray, ...], noise: PixelNoise) -> PixelNoise:
    """Noise of the windows of `drawn`, of which no fit absorbs anything."""
    signal, square, residual, weight = windows
    found = noise.copy()
    own = found.floor_dn2, found.slope_dn, found.contrast2, found.stated_contrast2
    measure_variance(signal, square, residual, weight, np.zeros_like(signal), *own)
    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("slope", "assumed"), [(0.4, 0.4), (0.4, 1.5), (2.0, 0.5)])
def test_the_slope_is_that_of_the_noise_for_any_assumed_slope(
    slope: float, assumed: float, seed: int
) -> None:
    windows = drawn(slope, 0.0, seed)
    found = measured(windows, pixel_noise(4.0, assumed, 6))
    # The variance of n pixels is known to sqrt(2 / n) of itself, here of those brighter than the floor; the
    # contrast, free as well, doubles the deviation.
    pixels = 6 * np.pi * 4.0**2 * 2.0
    assert found.slope_dn == pytest.approx(np.full(6, slope), rel=4.5 * 2.0 * np.sqrt(2 / pixels))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("stated", [0.0, 0.04])
def test_the_contrast_is_that_of_the_speckle(stated: float, seed: int) -> None:
    windows = drawn(0.02, 0.03, seed)
    noise = replace(pixel_noise(4.0, 0.02, 6, stated), stated_contrast2=stated)
    found = measured(windows, noise)
    pixels = 6 * np.pi * 4.0**2 * 2.0
    assert found.contrast2 == pytest.approx(np.full(6, 0.03), rel=4.5 * 1.5 * np.sqrt(2 / pixels))


def test_a_window_that_fits_badly_does_not_speak_for_the_others() -> None:
    windows = drawn(0.5, 0.0, 4)
    windows[2][2] *= 10.0
    found = measured(windows, pixel_noise(4.0, 0.5, 6))
    total = found.slope_dn + 200.0 * found.contrast2
    others = np.delete(total, 2)
    assert others == pytest.approx(np.full(5, 0.5), rel=0.3)
    assert total[2] > 10 * others[0]


def test_the_speckle_of_a_centroid_gives_the_contrast_of_its_grains() -> None:
    """650 nm, f/2, 7.5 um: grains of (4 / pi) (0.173 px)^2, a centroid moves by 0.173 / (sqrt(2) pi) px."""
    grain_px = 0.65 * 2.0 / 7.5
    found = stated_contrast2(grain_px / (np.sqrt(2.0) * np.pi))
    # The exact contrast, averaged over a pixel, is that of test_photon_transfer.
    assert found == pytest.approx(0.0312, rel=0.04)


@pytest.mark.parametrize("speckle_sd_px", [0.0, 0.01, 0.037, 0.05, 0.1, 0.15])
def test_the_contrast_gives_back_the_stated_speckle(speckle_sd_px: float) -> None:
    """A centroid moves by sqrt(a / 8 pi), with a = c^2 (1 + 1.3 c)."""
    contrast = np.sqrt(stated_contrast2(speckle_sd_px))
    area = contrast**2 * (1.0 + 1.3 * contrast)
    assert np.sqrt(area / (8.0 * np.pi)) == pytest.approx(speckle_sd_px, rel=1e-12)
