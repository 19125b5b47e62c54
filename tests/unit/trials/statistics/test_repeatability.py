"""Repeatability and reproducibility (ISO 5725-2)."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.statistics import spread
from tests.support.trial_readings import autoregressive, drawn_readings
from workbench.model.arrays import FloatArray
from workbench.trials.statistics.autocorrelation import Autocorrelation
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.repeatability import (
    cochran,
    grubbs,
    repeatability,
    repeatability_alone,
)

GLUCOSE_A = [
    [41.03, 41.45, 41.37],
    [41.17, 42.00, 41.15],
    [41.01, 40.68, 42.66],
    [39.37, 42.37, 42.63],
    [41.88, 41.19, 41.32],
    [43.28, 40.50, 42.28],
    [41.08, 41.27, 39.02],
    [43.36, 42.65, 41.72],
]
"""Material A of the glucose example of ASTM E691: 8 laboratories, 3 results each."""
GUM_H5_MEANS_UV = [172, 116, 13, 144, 106, 31, 60, 125, 163, 41]
"""Mean voltage of each day above 10 V, GUM table H.9."""
GUM_H5_SDS_UV = [60, 77, 111, 101, 67, 93, 80, 73, 88, 86]


def frame(values: object) -> pd.DataFrame:
    """Readings of an array (placement, repeat)."""
    array: FloatArray = np.asarray(values, np.float64)
    placement = np.repeat(np.arange(len(array)), array.shape[1])
    return pd.DataFrame({"error_mm": array.ravel(), "placement": placement})


def test_glucose_example_of_astm_e691() -> None:
    found = repeatability(frame(GLUCOSE_A))
    assert found.repeatability.value == pytest.approx(1.063, abs=5e-4)
    assert found.reproducibility.value == pytest.approx(1.063, abs=5e-4)
    assert found.between_placements == 0
    assert (found.readings, found.placements, found.sessions) == (24, 8, 1)
    assert found.repeatability_limit == pytest.approx(2.8 * 1.063, abs=2e-3)


def test_analysis_of_variance_of_gum_h5() -> None:
    pattern = np.array([-1.2, -0.5, 0.1, 0.4, 1.2])
    pattern = (pattern - pattern.mean()) / pattern.std(ddof=1)
    means, sds = np.array(GUM_H5_MEANS_UV, float), np.array(GUM_H5_SDS_UV, float)
    found = repeatability(frame(means[:, None] + sds[:, None] * pattern))
    assert found.repeatability.value == pytest.approx(85, abs=0.5)
    assert found.repeatability.degrees_of_freedom == 40
    assert found.between_placements == pytest.approx(43, abs=0.5)


@pytest.mark.long_cases
@pytest.mark.parametrize(("placement_sd", "session_sd"), [(0.0, 0.0), (0.5, 0.0), (2.0, 0.0), (0.5, 0.8)])
def test_intervals_cover_93_to_97_percent(placement_sd: float, session_sd: float) -> None:
    shape, trials = ((8, 4, 3) if session_sd else (1, 8, 3)), 1000
    random = np.random.default_rng(15)
    within = between = 0
    total = np.sqrt(0.3**2 + placement_sd**2 + session_sd**2)
    for _ in range(trials):
        found = repeatability(drawn_readings(random, shape, (session_sd, placement_sd, 0.3)))
        within += found.repeatability.low <= 0.3 <= found.repeatability.high
        between += found.reproducibility.low <= total <= found.reproducibility.high
    assert 0.93 - spread(0.93, trials) / 2 < within / trials < 0.97 + spread(0.97, trials) / 2
    assert 0.93 - spread(0.93, trials) / 2 < between / trials < 0.97 + spread(0.97, trials) / 2


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_s_r_alone_is_that_of_the_whole_statistics(rho: float) -> None:
    readings = drawn_readings(np.random.default_rng(17), (2, 4, 12), (0.3, 0.2, 0.1))
    dependence = Autocorrelation(lag1=rho)
    alone, whole = (
        repeatability_alone(readings, dependence),
        repeatability(readings, dependence).repeatability,
    )
    assert (alone.value, alone.low, alone.high) == pytest.approx((whole.value, whole.low, whole.high))


@pytest.mark.parametrize(("placement_sd", "session_sd"), [(0.0, 0.0), (0.5, 0.0), (0.5, 0.8)])
def test_variance_without_truncation_is_unbiased(placement_sd: float, session_sd: float) -> None:
    shape, random = ((4, 4, 3) if session_sd else (1, 8, 3)), np.random.default_rng(16)
    draws = [drawn_readings(random, shape, (session_sd, placement_sd, 0.3)) for _ in range(300)]
    found = np.array([repeatability(one).unbiased_variance for one in draws])
    standard_error = found.std(ddof=1) / np.sqrt(len(found))
    total = 0.3**2 + placement_sd**2 + session_sd**2
    assert found.mean() == pytest.approx(total, abs=4 * standard_error)


def test_autocorrelated_repeats_are_corrected() -> None:
    random, rho, trials = np.random.default_rng(4), 0.6, 400
    within, between = [], []
    for _ in range(trials):
        found = repeatability(frame(autoregressive(random, rho, (8, 20))), Autocorrelation(lag1=rho))
        within.append(found.repeatability.value**2)
        between.append(found.repeatability.low <= 1 <= found.repeatability.high)
    assert np.mean(within) == pytest.approx(1, abs=4 * np.std(within) / np.sqrt(trials))
    assert 0.92 - spread(0.92, trials) < np.mean(between)


def test_one_placement_or_one_reading_each_gives_no_precision() -> None:
    with pytest.raises(TooFewReadingsError, match="placements"):
        repeatability(frame([[1.0, 2.0]]))
    with pytest.raises(TooFewReadingsError, match="readings"):
        repeatability(frame([[1.0], [2.0]]))


def test_readings_without_any_scatter_have_zero_intervals() -> None:
    found = repeatability(frame([[1.0, 1.0], [1.0, 1.0]]))
    assert (found.repeatability.high, found.reproducibility.high, found.between_placements) == (0, 0, 0)


def critical_frame(statistic: float) -> pd.DataFrame:
    """Eight placements of three readings, the first with this share of the sum of variances."""
    shares = np.array([statistic, *[(1 - statistic) / 7] * 7])
    return frame(np.sqrt(shares)[:, None] * np.array([-1.0, 0.0, 1.0]))


@pytest.mark.parametrize(("critical", "level"), [(0.516, 0.05), (0.615, 0.01)])
def test_cochrans_critical_values_of_iso_5725_2(critical: float, level: float) -> None:
    found = cochran(critical_frame(critical))
    assert found.group == 0
    assert found.statistic == pytest.approx(critical)
    assert found.probability == pytest.approx(level, rel=0.03)


@pytest.mark.parametrize(("critical", "level"), [(2.126, 0.05), (2.274, 0.01)])
def test_grubbs_critical_values_of_iso_5725_2(critical: float, level: float) -> None:
    others = np.array([-1.0, -0.6, -0.2, 0.1, 0.4, 0.5, 0.8])
    others -= others.mean()
    # With one value at x and the others about 0: G = 7/8 x / s, s^2 = (q + 7/8 x^2) / 7, q their squares.
    x = critical * np.sqrt((others @ others) / 7 / (0.875**2 - critical**2 / 8))
    found = grubbs(pd.Series([*others, x], index=list("abcdefgh")))
    assert found.group == "h"
    assert found.statistic == pytest.approx(critical)
    assert found.probability == pytest.approx(level, rel=0.03)


def test_outlier_tests_alarm_at_their_level_without_outliers() -> None:
    random, trials = np.random.default_rng(8), 800
    alarms = np.zeros(2)
    for _ in range(trials):
        readings = drawn_readings(random, (1, 8, 3), (0, 0.5, 0.3))
        alarms += (
            cochran(readings).probability < 0.05,
            grubbs(readings.groupby("placement")["error_mm"].mean()).probability < 0.05,
        )
    assert (alarms / trials).max() < 0.05 + spread(0.05, trials)
    assert (alarms / trials).min() > 0.04 - spread(0.04, trials)


def test_outlier_tests_of_equal_placements_find_none() -> None:
    same = frame(np.ones((4, 2)))
    assert cochran(same).probability == 1
    assert grubbs(same.groupby("placement")["error_mm"].mean()).probability == 1
