"""Estimates with intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.support.statistics import spread
from workbench.trials.statistics.estimate import TooFewReadingsError, mean_estimate, require, sd_estimate


def test_mean_has_students_interval() -> None:
    values = np.array([1.2, 0.8, 1.9, 1.1])
    found = mean_estimate(values)
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))
    assert found.degrees_of_freedom == 3


@pytest.mark.parametrize("seed", [1, 2])
def test_interval_of_a_standard_deviation_covers_95_percent(seed: int) -> None:
    drawn = np.random.default_rng(seed).normal(0, 0.7, (4000, 6)).var(axis=1, ddof=1)
    found = [sd_estimate(float(one), 5) for one in drawn]
    covered = np.mean([one.low <= 0.7 <= one.high for one in found])
    assert covered == pytest.approx(0.95, abs=spread(0.95, 4000))


def test_too_few_readings_are_bad_input_that_names_the_numbers() -> None:
    with pytest.raises(TooFewReadingsError, match=r"3 placements.*2") as caught:
        require(2, 3, "placements")
    assert caught.value.exit_code == 2
