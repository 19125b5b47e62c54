"""Interval of a weighted sum of mean squares."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.statistics import spread
from workbench.trials.statistics.estimate import sd_estimate
from workbench.trials.statistics.mean_squares import combined_sd


def test_one_mean_square_has_the_chi_square_interval() -> None:
    found, expected = combined_sd([1.0], [0.49], [5]), sd_estimate(0.49, 5)
    assert (found.value, found.low, found.high) == pytest.approx(
        (expected.value, expected.low, expected.high)
    )
    assert found.degrees_of_freedom == pytest.approx(5)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_interval_of_a_sum_covers_93_to_97_percent(seed: int) -> None:
    random = np.random.default_rng(seed)
    weights, true, dofs = [0.3, 0.7], [4.0, 1.0], [7, 16]
    sd = np.sqrt(np.dot(weights, true))
    draws = np.array(true) * random.chisquare(dofs, (3000, 2)) / dofs
    found = [combined_sd(weights, list(draw), dofs) for draw in draws]
    covered = np.mean([one.low <= sd <= one.high for one in found])
    assert 0.93 - spread(0.93, 3000) < covered < 0.97 + spread(0.97, 3000)


def test_no_variance_is_a_zero_interval() -> None:
    found = combined_sd([0.5, 0.5], [0.0, 0.0], [3, 4])
    assert (found.value, found.low, found.high, found.degrees_of_freedom) == (0, 0, 0, 7)
