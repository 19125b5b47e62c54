"""Exact binomial intervals, and the share of readings inside their intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest
from statsmodels.stats.proportion import proportion_confint

from workbench.trials.statistics.coverage import (
    clopper_pearson,
    effective_number,
    interval_coverage,
    upper_bound,
)
from workbench.trials.statistics.estimate import TooFewReadingsError


@pytest.mark.parametrize(("successes", "n"), [(0, 100), (10, 100), (100, 100), (1, 1), (3, 7)])
def test_interval_agrees_with_two_other_implementations(successes: int, n: int) -> None:
    found = clopper_pearson(successes, n)
    assert found == pytest.approx(tuple(binomtest(successes, n).proportion_ci()), abs=1e-9)
    assert found == pytest.approx(proportion_confint(successes, n, method="beta"), abs=1e-9)


def test_published_intervals() -> None:
    assert clopper_pearson(10, 100) == pytest.approx((0.049, 0.176), abs=5e-4)
    assert upper_bound(0, 100) == pytest.approx(0.0295, abs=5e-5)
    assert upper_bound(5, 5) == 1


def test_more_successes_than_trials_are_refused() -> None:
    with pytest.raises(ValueError, match="successes"):
        clopper_pearson(3, 2)


def readings(errors: list[float], placement: list[int]) -> pd.DataFrame:
    return pd.DataFrame({"error_mm": errors, "expanded_mm": 1.0, "placement": placement})


def test_coverage_counts_placements_not_readings() -> None:
    found = interval_coverage(readings([0.5] * 30 + [1.5] * 10, [0] * 10 + [1] * 10 + [2] * 10 + [3] * 10))
    assert (found.value, found.degrees_of_freedom) == (0.75, 4)
    assert (found.low, found.high) == pytest.approx(clopper_pearson(3, 4))


def test_a_placement_partly_inside_counts_in_part() -> None:
    found = interval_coverage(readings([0.5, 1.5, 0.5, 0.5], [0, 0, 1, 1]))
    assert found.value == 0.75
    assert found.low < 0.75 < found.high


def test_readings_without_an_error_are_left_out() -> None:
    assert interval_coverage(readings([0.5, np.nan], [0, 1])).degrees_of_freedom == 1
    with pytest.raises(TooFewReadingsError):
        interval_coverage(readings([np.nan], [0]))


def test_effective_number_is_that_of_independent_squares() -> None:
    assert effective_number(np.eye(5)) == pytest.approx(5)
    assert effective_number(np.ones((5, 5))) == 1
    # The mean square of correlated normal values scatters as that of fewer independent ones.
    correlation = 0.5 + 0.5 * np.eye(6)
    values = np.random.default_rng(3).multivariate_normal(np.zeros(6), correlation, 20_000)
    variance = (values**2).mean(axis=1).var()
    assert 2 / variance == pytest.approx(effective_number(correlation), rel=0.06)
