"""Scatter of placements against their stated deviation: false alarms, scale, outliers."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.calibration.estimation.placement_scatter import PlacementScatter, placement_scatter
from workbench.model.arrays import FloatArray

PLACEMENTS = 11


def scatter_of(rng: np.random.Generator, errors: FloatArray) -> PlacementScatter:
    """Of errors with unit priors, each measured with its noise beside a common shift.

    Near placements are measured to a fraction of their prior, far ones hardly.
    """
    noise_sd = np.geomspace(0.1, 30.0, PLACEMENTS)
    design = np.column_stack([np.eye(PLACEMENTS), np.ones(PLACEMENTS)]) / noise_sd[:, None]
    measured = (errors + rng.normal(0.0, noise_sd)) / noise_sd
    prior = np.diag([*np.ones(PLACEMENTS), 0.01])
    covariance = np.asarray(np.linalg.inv(design.T @ design + prior), float)
    mean = covariance @ design.T @ measured
    return placement_scatter(mean[:PLACEMENTS], covariance[:PLACEMENTS, :PLACEMENTS])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_as_stated_are_not_significant(seed: int) -> None:
    """400 fits: the p value is below 0.01 in at most 2.5 % (expected 1 %, binomial sd 0.5 %)."""
    rng = np.random.default_rng(seed)
    found = [scatter_of(rng, rng.normal(0.0, 1.0, PLACEMENTS)) for _ in range(400)]
    assert np.mean([one.p_value < 0.01 for one in found]) <= 0.025
    assert np.mean([one.scale > 1 for one in found]) <= 0.16


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_four_times_as_large_are_scaled_by_about_four(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = [scatter_of(rng, rng.normal(0.0, 4.0, PLACEMENTS)) for _ in range(200)]
    scales = np.array([one.scale for one in found])
    assert np.mean(scales > 1) > 0.9
    assert np.median(scales) == pytest.approx(4.0, rel=0.15)
    # 2 / nu is the relative variance of the estimated variances; that of 200 is known to some 20 %.
    variances = scales[scales > 1] ** 2
    freedom = np.median([one.degrees_of_freedom for one in found if one.scale > 1])
    assert 2 * (variances.mean() / variances.std()) ** 2 == pytest.approx(freedom, rel=0.4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_placement_far_off_is_an_outlier_and_no_scatter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    errors = rng.normal(0.0, 1.0, PLACEMENTS)
    errors[2] += 25.0
    found = scatter_of(rng, errors)
    assert found.outliers == (2,)
    assert found.scale < 2.0


def test_data_that_say_nothing_of_the_placements_leave_the_scale() -> None:
    nothing = placement_scatter(np.zeros(PLACEMENTS), np.eye(PLACEMENTS) * (1 - 1e-9))
    assert (nothing.scale, nothing.p_value, nothing.outliers) == (1.0, 1.0, ())
    assert nothing.degrees_of_freedom == np.inf


def test_two_placements_beside_an_outlier_have_no_scatter() -> None:
    """The two of 2.2 deviations alone would have a p value of 0.008."""
    found = placement_scatter(np.array([2.2, 60.0, -2.2]), np.eye(3) * 1e-3)
    assert found == PlacementScatter(1.0, 1.0, (1,))


def test_two_placements_have_no_scatter() -> None:
    assert placement_scatter(np.array([9.0, -9.0]), np.eye(2) * 0.1).scale == 1.0
