"""Level, variance and photon-transfer slope estimated from simulated noise."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.noise import ROUNDING_DN2, PixelNoise, level_and_variance, photon_transfer_slope

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


def drawn(slope: float, seed: int, windows: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signal, residual and inverse variance of windows with a floor of 4 DN^2."""
    rng = np.random.default_rng(seed)
    signal = rng.uniform(20.0, 400.0, (windows, 21, 21))
    variance = 4.0 + slope * signal
    return signal, rng.normal(0.0, np.sqrt(variance)), 1.0 / variance


def noise(windows: int, assumed: float) -> PixelNoise:
    return PixelNoise(np.full(windows, 4.0), np.full(windows, assumed))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("slope", "assumed"), [(0.4, 0.4), (0.4, 1.5), (2.0, 0.5)])
def test_the_slope_is_that_of_the_noise_for_any_assumed_slope(
    slope: float, assumed: float, seed: int
) -> None:
    signal, residual, weight = drawn(slope, seed)
    found = photon_transfer_slope(signal, residual, weight, np.zeros_like(signal), noise(6, assumed))
    # The variance of n pixels is known to sqrt(2 / n) of itself; the floor's share is small.
    assert found == pytest.approx(np.full(6, slope), rel=4.5 * np.sqrt(2 / signal.size))


def test_a_window_that_fits_badly_does_not_speak_for_the_others() -> None:
    signal, residual, weight = drawn(0.5, 4)
    residual[2] *= 10.0
    found = photon_transfer_slope(signal, residual, weight, np.zeros_like(signal), noise(6, 0.5))
    others = np.delete(found, 2)
    assert others == pytest.approx(np.full(5, 0.5), rel=4.5 * np.sqrt(2 / signal[1:].size))
    assert found[2] > 10 * others[0]
