"""Density and integral of the Gaussian, compared with scipy."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from workbench.spots.kernels.gaussian import fill_gaussian


def test_density_and_integral_are_those_of_scipy() -> None:
    for size in (1, 12, 54, 100_001):
        z = np.linspace(-37.0, 37.0, size)
        density, integral = np.empty(size), np.empty(size)
        fill_gaussian(z, density, integral)
        np.testing.assert_allclose(density, norm.pdf(z), rtol=1e-13)
        np.testing.assert_allclose(integral, norm.cdf(z) - 0.5, rtol=0, atol=1e-14)


def test_places_far_outside_have_no_density() -> None:
    z = np.array([-1e6, -100.0, 100.0, 1e6])
    density, integral = np.empty(4), np.empty(4)
    fill_gaussian(z, density, integral)
    assert (density < 1e-300).all()
    assert integral.tolist() == [-0.5, -0.5, 0.5, 0.5]


def test_a_place_that_is_no_number_gives_none() -> None:
    density, integral = np.empty(2), np.empty(2)
    fill_gaussian(np.array([0.0, np.nan]), density, integral)
    assert np.isfinite([density[0], integral[0]]).all()
    assert np.isnan([density[1], integral[1]]).all()
