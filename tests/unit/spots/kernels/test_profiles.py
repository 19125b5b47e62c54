"""Profiles of a spot along an axis against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from tests.support.draw import Drawn
from tests.support.draw import profile as drawn_profile
from workbench.spots.kernels.profiles import profile as axis_profiles
from workbench.spots.kernels.profiles import sheared_rows, upright_rows


@pytest.mark.parametrize("sd", [0.3, 0.6, 1.5, 4.0])
def test_share_of_a_pixel_is_the_integral_of_the_density(sd: float) -> None:
    profiles = np.empty((4, 8))
    axis_profiles(3.2, float(np.log(sd)), profiles)
    shares = profiles[0]
    for pixel, share in enumerate(shares):
        whole, _ = quad(norm(3.2, sd).pdf, pixel - 0.5, pixel + 0.5, epsabs=1e-13)
        assert share == pytest.approx(whole, abs=1e-11)


@pytest.mark.parametrize("sd", [0.4, 1.1, 3.0])
def test_derivatives_of_the_share_are_those_of_differences(sd: float) -> None:
    step, at = 1e-5, np.array([6.3, np.log(sd)])

    def shares(centre: float, ln_sd: float) -> np.ndarray:
        found = np.empty((4, 14))
        axis_profiles(centre, ln_sd, found)
        return found

    here = shares(*at)
    for row, change in ((1, np.array([step, 0.0])), (2, np.array([0.0, step]))):
        difference = (shares(*(at + change))[0] - shares(*(at - change))[0]) / (2 * step)
        np.testing.assert_allclose(here[row], difference, atol=1e-8)
    np.testing.assert_array_equal(here[3], 1.0)


@pytest.mark.parametrize("shear", [0.0, 0.4, -0.8])
def test_rows_hold_all_light_of_a_spot_inside_the_window(shear: float) -> None:
    params = np.array([0.0, 1.0, 20.3, 19.8, np.log(1.6), np.log(1.3), shear])
    rows = np.empty((7, 41, 41))
    sheared_rows(params, rows)
    assert rows[1].sum() == pytest.approx(1.0, abs=1e-6)
    # Moved, widened or sheared a spot keeps its flux.
    np.testing.assert_allclose(rows[2:].sum(axis=(1, 2)), 0.0, atol=1e-5)
    np.testing.assert_array_equal(rows[0], 1.0)


def test_an_upright_spot_is_that_of_the_error_function() -> None:
    rows = np.empty((6, 15, 17))
    upright_rows(np.array([0.0, 1.0, 7.3, 6.8, np.log(1.1), np.log(1.7)]), rows)
    np.testing.assert_allclose(rows[1], drawn_profile((15, 17), Drawn(7.3, 6.8, 1.0, 1.1, 1.7)), atol=1e-14)
