"""The factor on the stated noise that residuals call for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from workbench.calibration.estimation.noise_scale import SCATTER_SIGNIFICANCE, significant_scale


def test_residuals_three_times_as_large_call_for_three() -> None:
    assert float(significant_scale(9.0 * 40, 40.0)) == pytest.approx(3.0)


def test_what_chance_allows_is_left_alone_and_the_limit_is_the_chi_square_s() -> None:
    limit = chi2.isf(SCATTER_SIGNIFICANCE, 50)
    found = significant_scale([50.0, 0.99 * limit, 1.01 * limit], [50.0] * 3)
    assert found[:2].tolist() == [1.0, 1.0]
    assert found[2] == pytest.approx(np.sqrt(1.01 * limit / 50))


def test_residuals_smaller_than_stated_do_not_shrink_the_noise() -> None:
    assert float(significant_scale(2.0, 50.0)) == 1.0


@pytest.mark.parametrize("freedom", [0.3, 1.0, 2.0])
def test_a_fraction_of_a_degree_of_freedom_counts(freedom: float) -> None:
    assert float(significant_scale(100.0, freedom)) == pytest.approx(np.sqrt(100.0 / freedom))


@pytest.mark.parametrize("freedom", [0.0, -1e-9])
def test_without_a_degree_of_freedom_nothing_is_called_for(freedom: float) -> None:
    assert float(significant_scale(1e6, freedom)) == 1.0


def test_the_chance_of_a_scale_above_one_is_the_stated_one() -> None:
    draws = np.random.default_rng(1).chisquare(30, 20_000)
    share = float((significant_scale(draws, np.full(20_000, 30.0)) > 1).mean())
    # Binomial: sqrt(0.01 x 0.99 / 20 000) = 0.0007.
    assert share == pytest.approx(SCATTER_SIGNIFICANCE, abs=4 * 0.0007)
