"""Gauge repeatability and reproducibility."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from tests.support.statistics import spread
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.gauge_rr import gauge_rr

AIAG = """
 0.29 -0.56  1.34  0.47 -0.80  0.02  0.59 -0.31  2.26 -1.36
 0.41 -0.68  1.17  0.50 -0.92 -0.11  0.75 -0.20  1.99 -1.25
 0.64 -0.58  1.27  0.64 -0.84 -0.21  0.66 -0.17  2.01 -1.31
 0.08 -0.47  1.19  0.01 -0.56 -0.20  0.47 -0.63  1.80 -1.68
 0.25 -1.22  0.94  1.03 -1.20  0.22  0.55  0.08  2.12 -1.62
 0.07 -0.68  1.34  0.20 -1.28  0.06  0.83 -0.34  2.19 -1.50
 0.04 -1.38  0.88  0.14 -1.46 -0.29  0.02 -0.46  1.77 -1.49
-0.11 -1.13  1.09  0.20 -1.07 -0.67  0.01 -0.56  1.45 -1.77
-0.15 -0.96  0.67  0.11 -1.45 -0.49  0.21 -0.49  1.87 -2.16
"""
"""Study of AIAG's manual (3 appraisers, each with 3 trials of 10 parts), one trial a line."""


def frame(values: FloatArray) -> pd.DataFrame:
    """Readings of an array (operator, trial, part)."""
    operator, _, part = np.indices(values.shape).reshape(3, -1)
    return pd.DataFrame({"operator": operator, "part": part, "measured_mm": values.ravel()})


def drawn(
    random: np.random.Generator, sds: tuple[float, float, float, float], shape: tuple[int, int, int]
) -> FloatArray:
    """Readings (operator, trial, part) with deviations of operator, interaction, readings and part."""
    operators, _, parts = shape
    return np.asarray(
        random.normal(0, sds[0], (operators, 1, 1))
        + random.normal(0, sds[1], (operators, 1, parts))
        + random.normal(0, sds[2], shape)
        + random.normal(0, sds[3], (1, 1, parts)),
        np.float64,
    )


def test_aiag_study() -> None:
    found = gauge_rr(frame(np.array(AIAG.split(), float).reshape(3, 3, 10)))
    assert found.equipment.value == pytest.approx(0.1999, abs=5e-5)
    assert found.appraiser == pytest.approx(0.2268, abs=5e-5)
    assert found.gauge.value == pytest.approx(0.3024, abs=5e-5)
    assert found.part == pytest.approx(1.0423, abs=5e-5)
    assert found.distinct_categories == pytest.approx(4.86, abs=5e-3)
    assert found.interaction is None
    assert found.gauge_share == pytest.approx(0.3024 / np.hypot(0.3024, 1.0423), abs=1e-4)
    assert found.gauge.low < found.gauge.value < found.gauge.high


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_components_with_an_interaction_follow_from_statsmodels_mean_squares(seed: int) -> None:
    """Three operators, 10 parts, 2 trials: the interaction's divisor is the number of trials."""
    readings = frame(drawn(np.random.default_rng(seed), (0.5, 0.6, 0.2, 2.0), (3, 2, 10)))
    found = gauge_rr(readings)
    table = anova_lm(ols("measured_mm ~ C(part) * C(operator)", readings).fit())
    part, operator, both, error = table["sum_sq"] / table["df"]
    assert found.interaction == pytest.approx(np.sqrt((both - error) / 2))
    assert found.appraiser == pytest.approx(np.sqrt(max(0, (operator - both) / 20)))
    assert found.part == pytest.approx(np.sqrt((part - both) / 6))
    assert found.equipment.value == pytest.approx(np.sqrt(error))
    assert found.interaction_probability == pytest.approx(table["PR(>F)"].iloc[2])
    assert found.interaction == pytest.approx(0.6, abs=0.3)


@pytest.mark.long_cases
@pytest.mark.parametrize("interaction", [0.0, 0.5])
def test_interval_of_grr_covers_93_to_97_percent(interaction: float) -> None:
    random, trials = np.random.default_rng(12), 600
    true = np.sqrt(0.4**2 + interaction**2 + 0.3**2)
    fits = [gauge_rr(frame(drawn(random, (0.4, interaction, 0.3, 1.0), (6, 2, 8)))) for _ in range(trials)]
    covered = np.mean([one.gauge.low <= true <= one.gauge.high for one in fits])
    assert 0.93 - spread(0.93, trials) < covered < 0.97 + spread(0.97, trials)


def test_unequal_repeatability_is_found_and_an_equal_one_seldom_reported() -> None:
    """Two operators; sd = hypot(0.3, 1.6 (z / 2000)^2) mm at 300 to 2000 mm, and 0.3 mm everywhere."""
    random, trials = np.random.default_rng(12), 300
    z = np.array([300.0, 500.0, 800.0, 1300.0, 2000.0])
    without = []
    for sd in (np.hypot(0.3, 1.6 * (z / 2000) ** 2), np.full(5, 0.3)):
        fits = [gauge_rr(frame(z + sd * random.standard_normal((2, 3, 5)))) for _ in range(trials)]
        without.append(np.mean([not one.has_intervals for one in fits]))
    assert without[0] > 0.8 - spread(0.8, trials)
    assert without[1] < 0.05 + spread(0.05, trials)


@pytest.mark.parametrize("shape", [(1, 2, 5), (3, 1, 5), (3, 2, 1)])
def test_studies_without_degrees_of_freedom_are_refused(shape: tuple[int, int, int]) -> None:
    with pytest.raises(TooFewReadingsError):
        gauge_rr(frame(drawn(np.random.default_rng(1), (1, 0, 1, 1), shape)))


def test_a_missing_reading_is_named() -> None:
    readings = frame(drawn(np.random.default_rng(1), (1, 0, 1, 1), (3, 2, 4)))
    with pytest.raises(BadInputError, match="part 2 by operator 1"):
        gauge_rr(readings.drop(readings.index[(readings["part"] == 2) & (readings["operator"] == 1)][:1]))


def test_a_gauge_without_scatter_has_no_share() -> None:
    found = gauge_rr(frame(np.broadcast_to(np.arange(4.0), (3, 2, 4)).copy()))
    assert (found.gauge.value, found.gauge_share) == (0, 0)
    assert found.distinct_categories == np.inf
