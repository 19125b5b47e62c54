"""Profiles of a spot along an axis against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from workbench.spots.kernels.profiles import profile as axis_profiles


@pytest.mark.parametrize("sd", [0.3, 0.6, 1.5, 4.0])
def test_share_of_a_pixel_is_the_integral_of_the_density(sd: float) -> None:
    profiles = np.empty((4, 8))
    axis_profiles(3.2, float(np.log(sd)), profiles)
    shares = profiles[0]
    for pixel, share in enumerate(shares):
        whole, _ = quad(norm(3.2, sd).pdf, pixel - 0.5, pixel + 0.5, epsabs=1e-13)
        assert share == pytest.approx(whole, abs=1e-11)
