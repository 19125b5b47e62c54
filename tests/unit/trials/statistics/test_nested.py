"""Mean squares of nested readings, compared with statsmodels."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from statsmodels.formula.api import mixedlm, ols
from statsmodels.stats.anova import anova_lm

from tests.support.trial_readings import drawn_readings
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.nested import nested_squares


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_mean_squares_agree_with_statsmodels_for_unequal_numbers(seed: int) -> None:
    random = np.random.default_rng(seed)
    readings = drawn_readings(random, (3, 4, 5), (0.8, 0.5, 0.3)).sample(frac=0.7, random_state=seed)
    found = nested_squares(readings)
    cell = readings["session"] * 10 + readings["placement"]
    models = [
        ols(f"error_mm ~ {terms}", readings.assign(cell=cell)).fit()
        for terms in ("1", "C(session)", "C(cell)")
    ]
    table = anova_lm(*models)
    squares = table["ss_diff"] / table["df_diff"]
    assert (found.session, found.placement) == pytest.approx((squares[1], squares[2]))
    assert found.within == pytest.approx(models[2].mse_resid)
    assert found.within_dof == models[2].df_resid


def test_components_of_balanced_readings_agree_with_restricted_likelihood() -> None:
    readings = drawn_readings(np.random.default_rng(7), (1, 10, 4), (0.0, 0.6, 0.3))
    found = nested_squares(readings)
    fitted = mixedlm("error_mm ~ 1", readings, groups="placement").fit()
    between = (found.placement - found.within) / found.placement_size
    assert (found.within, between) == pytest.approx((fitted.scale, fitted.cov_re.iloc[0, 0]), rel=1e-4)


def test_total_variance_is_unbiased_for_unequal_numbers() -> None:
    random, totals = np.random.default_rng(3), []
    kept = np.random.default_rng(5).random(60) < 0.6
    for _ in range(800):
        weights, squares, _ = nested_squares(
            drawn_readings(random, (3, 4, 5), (0.8, 0.5, 0.3))[kept]
        ).total_variance()
        totals.append(float(np.dot(weights, squares)))
    assert np.mean(totals) == pytest.approx(0.98, abs=4 * np.std(totals) / np.sqrt(len(totals)))


def test_equal_labels_in_different_sessions_are_different_placements() -> None:
    readings = drawn_readings(np.random.default_rng(1), (2, 3, 2), (0, 0, 1))
    assert nested_squares(readings).placements == 6


@pytest.mark.parametrize("shape", [(1, 1, 4), (4, 1, 3), (1, 4, 1)])
def test_designs_that_leave_no_degrees_of_freedom_are_refused(shape: tuple[int, int, int]) -> None:
    readings: pd.DataFrame = drawn_readings(np.random.default_rng(1), shape, (1, 1, 1))
    with pytest.raises(TooFewReadingsError):
        nested_squares(readings)
