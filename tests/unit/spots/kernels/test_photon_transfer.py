"""The photon-transfer slope that residuals tell."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.spot_models import ROUND, drawn_windows
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import FLUX
from workbench.spots.noise import Noise


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
