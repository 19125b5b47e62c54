"""Speckle has the statistics of a round pupil."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j1

from workbench.emulator.keyed import generator
from workbench.emulator.speckle import speckle_field


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
