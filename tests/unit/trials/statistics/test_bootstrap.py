"""Bootstrap over groups: against scipy's bootstrap, and coverage of a known mean."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, bootstrap

from workbench.trials.statistics.bootstrap import grouped_mean
from workbench.trials.statistics.estimate import TooFewReadingsError


def test_agrees_with_scipy_on_groups_of_one() -> None:
    values = np.random.default_rng(3).normal(5.0, 2.0, 40)
    found = grouped_mean([values[[n]] for n in range(len(values))])
    other = bootstrap((values,), np.mean, method="percentile", n_resamples=9999, rng=1).confidence_interval
    assert found.value == pytest.approx(values.mean())
    # Both ends are quantiles of 2000 and 9999 drawn means.
    assert (found.low, found.high) == pytest.approx((other.low, other.high), abs=0.06)


def test_values_of_one_group_count_as_one() -> None:
    """Intervals that take 50 equal errors of a group as independent would hold a fifth as often."""
    random, inside, runs = np.random.default_rng(1), 0, 200
    for _ in range(runs):
        groups = [np.full(50, error) for error in random.normal(0.0, 1.0, 25)]
        found = grouped_mean(groups)
        inside += found.low <= 0.0 <= found.high
    # The percentile interval of 25 groups holds about 93 %.
    assert binom.ppf(1e-4, runs, 0.93) <= inside <= binom.ppf(1 - 1e-4, runs, 0.93)


def test_one_group_has_no_interval() -> None:
    with pytest.raises(TooFewReadingsError, match="2 groups"):
        grouped_mean([np.ones(5)])
