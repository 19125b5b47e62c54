"""Straight line with errors in both coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.support.statistics import spread
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.line import fit_line

X = np.array([0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4])
Y = np.array([5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5])
X_WEIGHTS = np.array([1000.0, 1000, 500, 800, 200, 80, 60, 20, 1.8, 1])
Y_WEIGHTS = np.array([1.0, 1.8, 4, 8, 20, 20, 70, 70, 100, 500])
"""Pearson's data with York's weights."""


def test_pearsons_data_with_yorks_weights() -> None:
    found = fit_line(X, Y, X_WEIGHTS**-0.5, Y_WEIGHTS**-0.5)
    assert (found.slope, found.intercept) == pytest.approx((-0.480533, 5.47991), abs=5e-6)
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([0.057985, 0.294971], abs=5e-6)
    assert found.chi2 / found.degrees_of_freedom == pytest.approx(1.4833, abs=5e-5)


def test_agrees_with_a_general_minimiser() -> None:
    def chi2(line: np.ndarray) -> float:
        variance = 1 / Y_WEIGHTS + line[0] ** 2 / X_WEIGHTS
        return float(((Y - line[1] - line[0] * X) ** 2 / variance).sum())

    best = minimize(chi2, [-0.5, 5.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12})
    found = fit_line(X, Y, X_WEIGHTS**-0.5, Y_WEIGHTS**-0.5)
    assert (found.slope, found.intercept) == pytest.approx(tuple(best.x), abs=1e-6)
    assert found.chi2 == pytest.approx(best.fun)


def test_exact_abscissae_give_the_weighted_least_squares_line() -> None:
    sd = Y_WEIGHTS**-0.5
    found = fit_line(X, Y, np.zeros(10), sd)
    expected, covariance = np.polyfit(X, Y, 1, w=1 / sd, cov="unscaled")
    assert (found.slope, found.intercept) == pytest.approx(tuple(expected))
    assert found.covariance == pytest.approx(covariance)


def test_interval_of_the_slope_covers_95_percent() -> None:
    random, trials = np.random.default_rng(2), 2000
    x = np.linspace(0, 10, 8)
    inside = 0
    for _ in range(trials):
        found = fit_line(
            x + random.normal(0, 0.1, 8),
            2 + 0.7 * x + random.normal(0, 0.1, 8),
            np.full(8, 0.1),
            np.full(8, 0.1),
        )
        inside += abs(found.slope - 0.7) <= 1.96 * np.sqrt(found.covariance[0, 0])
    assert inside / trials == pytest.approx(0.95, abs=spread(0.95, trials))


def test_points_without_a_line_are_refused() -> None:
    with pytest.raises(TooFewReadingsError):
        fit_line(X[:1], Y[:1], X[:1], Y[:1])
    with pytest.raises(ValueError, match="different x"):
        fit_line(np.ones(3), Y[:3], np.zeros(3), np.ones(3))
