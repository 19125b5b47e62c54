"""Error budget: alarms with complete and with incomplete sources."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.statistics import spread
from workbench.trials.statistics.error_budget import ALARM_PROBABILITY, ErrorBudget, budget_test

SOURCES = {"spot noise": 0.3, "speckle": 0.2, "placement": 0.4}


def test_unexplained_variance_and_its_interval() -> None:
    budget = ErrorBudget(0.5, 10, SOURCES)
    assert budget.explained_mm2 == pytest.approx(0.29)
    low, high = (10 * 0.5 / float(chi2.ppf(p, 10)) for p in (0.975, 0.025))
    assert budget.unexplained_mm2 == pytest.approx((0.21, low - 0.29, high - 0.29))
    assert not budget.alarm


@pytest.mark.parametrize("name", SOURCES)
def test_a_source_alone_is_the_budget(name: str) -> None:
    alone = {name: SOURCES[name]}
    assert ErrorBudget(SOURCES[name] ** 2, 5, alone).unexplained_mm2[0] == pytest.approx(0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_alarm_rates(seed: int) -> None:
    """Eleven standoffs of 8 placements (77 degrees of freedom); the missing source equals the rest."""
    random, trials = np.random.default_rng(seed), 1000
    draws = 0.29 * random.chisquare(7, (trials, 11)) / 7
    complete, incomplete = (
        [
            budget_test([ErrorBudget(scale * one, 7, SOURCES) for one in row]).probability < ALARM_PROBABILITY
            for row in draws
        ]
        for scale in (1.0, 2.0)
    )
    assert np.mean(complete) == pytest.approx(ALARM_PROBABILITY, abs=spread(ALARM_PROBABILITY, trials))
    assert np.mean(incomplete) > 0.95
    single = [ErrorBudget(one, 7, SOURCES).alarm for one in draws[:, 0]]
    assert np.mean(single) == pytest.approx(ALARM_PROBABILITY, abs=spread(ALARM_PROBABILITY, trials))


def test_ratio_is_weighted_by_degrees_of_freedom() -> None:
    found = budget_test([ErrorBudget(0.58, 30, SOURCES), ErrorBudget(0.29, 10, SOURCES)])
    assert found.ratio == pytest.approx(1.75)
    assert found.degrees_of_freedom == 40
