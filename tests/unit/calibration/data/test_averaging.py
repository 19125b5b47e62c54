"""Averages of repeats, and which of them are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from workbench.calibration.data.averaging import (
    INCONSISTENT_P,
    OUTLIER_SD,
    OUTLIER_SD_OF_FEW,
    is_inconsistent,
    outliers,
    outliers_of_few,
    scatter_chi2,
    usual_scale,
    weighted_mean,
)


def test_honest_repeats_are_hardly_ever_rejected() -> None:
    """As the comment of OUTLIER_SD says, also where the stated deviation is far too small."""
    rng = np.random.default_rng(5)
    draws = rng.normal(0.0, 1.0, (4000, 10, 2))
    far = sum(int(outliers(d, np.full((10, 2), 1e-3)).sum()) for d in draws)
    right = sum(int(outliers(d, np.full((10, 2), 1.0)).sum()) for d in draws)
    assert right == 0
    assert far < 2 * 4000 * 10 / 250


def test_the_mean_weighs_by_the_inverse_variance_and_skips_what_is_not_measured() -> None:
    position = np.array([[1.0, np.nan], [4.0, 7.0], [np.nan, np.nan]])
    mean, sd = weighted_mean(position, np.array([[1.0, 1.0], [0.5, 0.2], [0.1, 0.1]]))
    np.testing.assert_allclose(mean, [(1.0 + 4 * 4.0) / 5, 7.0])
    np.testing.assert_allclose(sd, [np.sqrt(1 / 5), 0.2])


def test_the_mean_of_nothing_is_unknown() -> None:
    mean, sd = weighted_mean(np.full((3, 2), np.nan), np.full((3, 2), 0.1))
    assert np.isnan(mean).all()
    assert np.isinf(sd).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_sd_of_the_mean_is_its_scatter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sd = np.array([[0.1, 0.3], [0.2, 0.1], [0.5, 0.2]])
    means = np.array([weighted_mean(rng.normal(0.0, sd), sd)[0] for _ in range(2000)])
    # 2000 draws know a deviation to 1 / sqrt(4000) = 1.6 %.
    np.testing.assert_allclose(means.std(axis=0), weighted_mean(np.zeros((3, 2)), sd)[1], rtol=0.065)


def test_scatter_is_the_chi_square_about_the_mean_and_its_freedom() -> None:
    position = np.array([[1.0, 5.0], [3.0, np.nan], [2.0, np.nan]])
    scatter, free = scatter_chi2(position, np.full((3, 2), 0.5))
    assert scatter == pytest.approx((1.0 + 1.0 + 0.0) / 0.25)
    assert free == 2
    assert scatter_chi2(position[:1], np.full((1, 2), 0.5)) == (0.0, 0)


@pytest.mark.parametrize(
    ("count", "limit"), [(3, OUTLIER_SD_OF_FEW), (9, OUTLIER_SD_OF_FEW), (10, OUTLIER_SD)]
)
@pytest.mark.parametrize(("beyond", "out"), [(0.99, False), (1.01, True)])
def test_a_repeat_is_a_stray_beyond_the_limit_for_so_many(
    count: int, limit: float, beyond: float, out: bool
) -> None:
    position, sd = np.zeros((count, 2)), np.full((count, 2), 0.1)
    position[0, 1] = beyond * limit * 0.1
    test = outliers_of_few if count < 10 else outliers
    assert test(position, sd).tolist() == [out] + [False] * (count - 1)


def test_each_test_leaves_the_other_s_counts_alone() -> None:
    wild = np.zeros((10, 2))
    wild[0] = 1e3
    assert not outliers(wild[:9], np.full((9, 2), 0.1)).any()
    assert not outliers_of_few(wild, np.full((10, 2), 0.1)).any()
    assert not outliers_of_few(wild[:2], np.full((2, 2), 0.1)).any()


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_the_usual_scale_is_what_most_spots_scatter(seed: int, factor: float) -> None:
    """A third of the spots inconsistent changes it by little: the median of 60 is known to some 5 %."""
    rng = np.random.default_rng(seed)
    position = rng.normal(0.0, factor, (60, 6, 2))
    position[:20] *= 50.0
    scatter = [scatter_chi2(one, np.ones((6, 2))) for one in position]
    assert usual_scale(scatter) == pytest.approx(factor, rel=0.35)


@pytest.mark.parametrize("free", [1, 2, 5])
def test_two_repeats_are_enough_for_the_usual_scale(free: int) -> None:
    median = 9.0 * float(chi2.isf(0.5, free))
    assert usual_scale([(0.1, free), (median, free), (1e3, free)] * 3) == pytest.approx(3.0)


def test_quiet_spots_have_scale_one_and_few_spots_none() -> None:
    quiet = [(1.0, 10)] * 20
    assert usual_scale(quiet) == 1.0
    assert np.isnan(usual_scale(quiet[:7]))
    assert np.isnan(usual_scale([(0.0, 0)] * 20))


def test_a_spot_is_torn_by_what_others_scatter() -> None:
    far = (chi2.isf(INCONSISTENT_P, 8) * 1.01, 8)
    assert is_inconsistent(far, 1.0)
    assert not is_inconsistent(far, 1.1)
    assert not is_inconsistent((chi2.isf(INCONSISTENT_P, 8) * 0.99, 8), 1.0)
    assert not is_inconsistent((1e6, 0), 1.0)
    assert not is_inconsistent(far, float("nan"))
