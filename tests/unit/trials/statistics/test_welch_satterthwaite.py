"""Effective degrees of freedom and expanded uncertainty (GUM annex G)."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.statistics import spread
from workbench.trials.statistics.welch_satterthwaite import combine, effective_degrees_of_freedom


def test_example_of_gum_g_4() -> None:
    found = combine([0.25, 0.57, 0.82], [9, 4, 14])
    assert found.degrees_of_freedom == pytest.approx(19.0, abs=0.05)
    assert found.k == pytest.approx(2.09, abs=0.005)
    assert found.expanded == pytest.approx(2.2, abs=0.05)


def test_end_gauge_of_gum_h_1() -> None:
    """Components of table H.1 in nm: standard, comparison, expansion difference, temperature difference."""
    found = combine([25.0, 9.7, 2.9, 16.6], [18, 25.6, 50, 2], confidence=0.99)
    assert found.u == pytest.approx(32, abs=0.5)
    assert found.degrees_of_freedom == pytest.approx(16, abs=1)
    assert found.expanded == pytest.approx(93, abs=1.5)


def test_exactly_known_components_have_the_factor_of_a_normal_distribution() -> None:
    found = combine([1.0, 2.0], [inf, inf])
    assert found.degrees_of_freedom == inf
    assert found.k == pytest.approx(norm.ppf(0.975))


def test_one_component_keeps_its_degrees_of_freedom() -> None:
    assert effective_degrees_of_freedom([0.3], [7]) == pytest.approx(7)


@pytest.mark.parametrize("seed", [1, 2])
def test_expanded_uncertainty_covers_95_percent_of_simulated_means(seed: int) -> None:
    random, trials = np.random.default_rng(seed), 4000
    a, b = random.normal(0, 1.0, (trials, 4)), random.normal(0, 0.5, (trials, 8))
    error = a.mean(axis=1) + b.mean(axis=1)
    inside = 0
    for one, u_a, u_b in zip(error, a.std(axis=1, ddof=1) / 2, b.std(axis=1, ddof=1) / 8**0.5, strict=True):
        inside += abs(one) <= combine([u_a, u_b], [3, 7]).expanded
    assert inside / trials == pytest.approx(0.95, abs=0.01 + spread(0.95, trials) / 2)
