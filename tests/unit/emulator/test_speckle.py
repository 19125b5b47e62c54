"""Speckle has the statistics of a round pupil."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j1

from workbench.emulator.keyed import generator
from workbench.emulator.speckle import speckle_field, subsamples


@pytest.mark.parametrize("grain", [0.1733, 0.5, 2.0])
def test_speckle_has_the_correlation_of_a_round_pupil(grain: float) -> None:
    """Mean 1, contrast 1, covariance (2 J1(x) / x)^2 with x = pi r / (lambda N)."""
    step = grain / 4
    fields = [speckle_field((256, 256), step, grain, 1.0, generator(5, "s", i)) for i in range(12)]
    assert np.mean(fields) == pytest.approx(1.0, abs=0.01)
    assert np.std(fields) == pytest.approx(1.0, abs=0.03)
    spectra = [np.abs(np.fft.fft2(field - 1)) ** 2 for field in fields]
    covariance = np.fft.ifft2(np.mean(spectra, axis=0)).real / 256**2
    for lag in (1, 2, 4, 5):
        x = np.pi * lag * step / grain
        assert covariance[0, lag] == pytest.approx((2 * j1(x) / x) ** 2, abs=0.02)


@pytest.mark.parametrize(("grain_px", "count"), [(0.05, 16), (0.1733, 9), (0.3, 5), (2.0, 4)])
def test_a_pixel_is_sampled_one_and_a_half_times_a_grain_within_limits(grain_px: float, count: int) -> None:
    assert subsamples(grain_px) == count


@pytest.mark.parametrize("contrast", [0.0, 0.4, 1.0])
def test_the_contrast_is_the_deviation_over_the_mean(contrast: float) -> None:
    fields = [speckle_field((256, 256), 0.1, 0.4, contrast, generator(2, "s", i)) for i in range(8)]
    # 8 x (25.6 px)^2 over grains of (4 / pi) (0.4 px)^2 are 26 000: a mean to 0.006, a deviation to 0.009.
    assert np.mean(fields) == pytest.approx(1.0, abs=4 * 0.006)
    assert np.std(fields) == pytest.approx(contrast, abs=4 * 0.009)


def test_fully_developed_speckle_is_exponential() -> None:
    """The share above t is exp(-t); 8 fields of 256 x 256 samples hold some 3000 grains each."""
    fields = np.stack([speckle_field((256, 256), 0.25, 1.0, 1.0, generator(3, "s", i)) for i in range(8)])
    assert fields.min() >= 0.0
    for level in (0.5, 1.0, 2.0, 4.0):
        assert (fields > level).mean() == pytest.approx(np.exp(-level), abs=0.015)
