"""Linearity of ranges."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import linregress

from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.linearity import linearity

TRUE_MM = np.array([100.0, 200.0, 300.0, 500.0])


def test_best_line_balances_the_largest_deviations() -> None:
    """A parabola over -1 to 1 deviates from the best line by half its sag, from its chord by the whole."""
    x = np.linspace(-1, 1, 201)
    found = linearity(1000 + 500 * x, 1000 + 500 * x + 2 * x**2)
    assert found.independent_mm == pytest.approx(1.0, abs=1e-6)
    assert found.absolute_mm == pytest.approx(2.0)
    assert (found.independent_percent, found.absolute_percent) == pytest.approx((0.1, 0.2), abs=1e-6)


def test_line_of_least_squares_agrees_with_scipy() -> None:
    measured = TRUE_MM * 1.01 + 3 + np.array([0.5, -0.4, 0.2, 0.1])
    found, expected = linearity(TRUE_MM, measured), linregress(TRUE_MM, measured)
    assert (found.slope, found.intercept_mm) == pytest.approx((expected.slope, expected.intercept))
    residuals = measured - expected.intercept - expected.slope * TRUE_MM
    assert found.rms_mm == pytest.approx(np.sqrt((residuals**2).sum() / 2))
    assert (found.full_scale_mm, found.n) == (400, 4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_line_deviates_less_than_the_best(seed: int) -> None:
    random = np.random.default_rng(seed)
    measured = TRUE_MM + random.normal(0, 1, 4)
    found = linearity(TRUE_MM, measured)
    tilts = np.linspace(-0.02, 0.02, 4001)[:, None]
    deviations = np.ptp(measured - (1 + tilts) * TRUE_MM, axis=1) / 2
    assert found.independent_mm == pytest.approx(deviations.min(), abs=0.002)


def test_a_scale_error_is_absolute_not_independent() -> None:
    found = linearity(TRUE_MM, 1.02 * TRUE_MM)
    assert (found.absolute_mm, found.independent_mm) == pytest.approx((10.0, 0.0), abs=1e-8)
    assert (found.slope, found.intercept_mm) == pytest.approx((1.02, 0.0), abs=1e-9)


def test_perfect_ranges_have_no_deviation() -> None:
    found = linearity(TRUE_MM, TRUE_MM.copy())
    assert (found.absolute_mm, found.slope) == (0, 1)
    assert found.independent_mm == pytest.approx(0, abs=1e-12)


def test_two_true_ranges_are_refused() -> None:
    with pytest.raises(TooFewReadingsError, match="3"):
        linearity(np.array([100.0, 100.0, 200.0]), np.ones(3))
