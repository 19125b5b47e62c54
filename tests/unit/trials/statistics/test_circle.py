"""Geometric circle fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm, t

from tests.support.statistics import spread
from workbench.model.arrays import FloatArray
from workbench.trials.statistics.circle import fit_circle
from workbench.trials.statistics.estimate import TooFewReadingsError

GANDER = np.array([(1, 7), (2, 6), (5, 8), (7, 7), (9, 5), (3, 7)], float)


def arc(random: np.random.Generator, sd_mm: float, n: int = 12) -> FloatArray:
    """Points on the front of a cylinder of 89 mm radius about (20, 500) mm."""
    angle = np.linspace(-1.0, 1.0, n)
    points = np.column_stack([20 + 89 * np.sin(angle), 500 - 89 * np.cos(angle)])
    return np.asarray(points + random.normal(0, sd_mm, points.shape), np.float64)


def test_published_example() -> None:
    found = fit_circle(GANDER)
    assert (*found.center_mm, found.radius_mm) == pytest.approx((4.7398, 2.9835, 4.7142), abs=5e-5)


def test_agrees_with_a_general_minimiser() -> None:
    points = arc(np.random.default_rng(3), 1.0)

    def squares(circle: FloatArray) -> float:
        return float(((np.hypot(*(points - circle[:2]).T) - circle[2]) ** 2).sum())

    best = minimize(
        squares,
        [0.0, 480.0, 80.0],
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 4000},
    )
    found = fit_circle(points)
    assert (*found.center_mm, found.radius_mm) == pytest.approx(tuple(best.x), abs=1e-5)
    assert found.rms_mm == pytest.approx(np.sqrt(best.fun / len(points)), rel=1e-6)


@pytest.mark.parametrize("stated", [0.2, None])
def test_interval_of_the_radius_covers_95_percent(stated: float | None) -> None:
    random, trials = np.random.default_rng(5), 1500
    k = norm.ppf(0.975) if stated else t.ppf(0.975, 9)
    fits = [fit_circle(arc(random, 0.2), stated) for _ in range(trials)]
    inside = [abs(one.radius_mm - 89) <= k * np.sqrt(one.covariance[2, 2]) for one in fits]
    assert np.mean(inside) == pytest.approx(0.95, abs=spread(0.95, trials))


def test_points_of_a_line_or_too_few_are_refused() -> None:
    with pytest.raises(ValueError, match="line"):
        fit_circle(np.array([(0, 0), (1, 1), (2, 2), (5, 5)], float), 0.1)
    with pytest.raises(TooFewReadingsError):
        fit_circle(GANDER[:3])
    assert fit_circle(GANDER[[0, 2, 4]], 0.1).rms_mm == pytest.approx(0, abs=1e-9)
