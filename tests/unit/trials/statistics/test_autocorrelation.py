"""Lag-1 autocorrelation and the widening of standard errors."""

from __future__ import annotations

import numpy as np
import pytest
from statsmodels.tsa.stattools import acf

from tests.support.statistics import spread
from tests.support.trial_readings import autoregressive
from workbench.model.arrays import FloatArray
from workbench.trials.statistics.autocorrelation import Autocorrelation, autocorrelation, standard_error


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.6])
@pytest.mark.parametrize(("series", "length"), [(8, 15), (8, 60), (1, 60)])
def test_bias_of_the_estimate_falls_with_the_square_of_the_length(
    rho: float, series: int, length: int
) -> None:
    random = np.random.default_rng(6)
    found = [
        autocorrelation(list(autoregressive(random, rho, (series, length)))).estimated for _ in range(400)
    ]
    assert np.mean(found) == pytest.approx(rho, abs=15 / length**2 + 4 * float(np.std(found)) / 20)


def test_a_long_series_agrees_with_statsmodels() -> None:
    (series,) = autoregressive(np.random.default_rng(1), 0.5, (1, 4000))
    assert autocorrelation([series]).estimated == pytest.approx(acf(series, nlags=1)[1], abs=2e-3)


def test_independent_readings_are_rarely_widened() -> None:
    random, trials = np.random.default_rng(3), 2000
    found = [autocorrelation(list(autoregressive(random, 0.0, (4, 20)))).lag1 > 0 for _ in range(trials)]
    assert np.mean(found) < 0.05 + spread(0.05, trials)


def test_alternating_readings_do_not_narrow_anything() -> None:
    found = autocorrelation([np.array([1.0, -1.0] * 10)])
    assert found.estimated < -0.5
    assert (found.lag1, found.variance_factor(20), found.dof_factor) == (0, 1, 1)


@pytest.mark.parametrize("rho", [0.3, 0.6])
def test_variance_factor_is_that_of_the_sum_of_correlations(rho: float) -> None:
    lags = np.arange(1, 12)
    expected = 1 + 2 * float(((1 - lags / 12) * rho**lags).sum())
    assert Autocorrelation(lag1=rho).variance_factor(12) == pytest.approx(expected)


def test_widened_standard_error_is_that_of_simulated_means() -> None:
    series = autoregressive(np.random.default_rng(9), 0.5, (4000, 20))
    stated = [standard_error(one, Autocorrelation(lag1=0.5)) ** 2 for one in series]
    assert np.mean(stated) == pytest.approx(series.mean(axis=1).var(), rel=0.1)


@pytest.mark.parametrize("series", [[], [np.array([1.0, 2.0, 3.0])], [np.ones(30)]])
def test_short_and_constant_series_have_no_coefficient(series: list[FloatArray]) -> None:
    found = autocorrelation(series)
    assert (found.lag1, found.estimated) == (0, 0)
