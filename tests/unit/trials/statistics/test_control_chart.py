"""Control charts: a published CUSUM, limits by Student, and run lengths of simulated sensors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.proofs.control_charts import CHARTS, DRIFT_SD, REPEATS, SENSORS, simulated
from workbench.trials.statistics.control_chart import (
    FALSE_ALARM,
    FIRST_SESSIONS,
    control_chart,
    cusum,
    frozen_limits,
)

FOUND_BEFORE = 3.0 / DRIFT_SD
"""Number of sessions in which the drift grows to 3 standard deviations."""

# NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.3: means of 20 samples about the target 325.
NIST = np.array(
    [
        324.925, 324.675, 324.725, 324.350, 325.350, 325.225, 324.125, 324.525, 325.225, 324.600,
        324.625, 325.150, 328.325, 327.250, 327.825, 328.500, 326.675, 327.775, 326.875, 328.350,
    ]
)  # fmt: skip
NIST_HIGH = [
    0,
    0,
    0,
    0,
    0.0325,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    3.0075,
    4.94,
    7.4475,
    10.63,
    11.9875,
    14.445,
    16.0025,
    19.035,
]


def test_cusum_as_published() -> None:
    assert cusum(NIST - 325.0, 0.3175) == pytest.approx(np.array(NIST_HIGH), abs=1e-9)


def test_limits_are_those_of_a_new_value_by_student() -> None:
    first = np.random.default_rng(1).normal(5.0, 2.0, FIRST_SESSIONS)
    scatter = np.full(FIRST_SESSIONS, 0.5)
    limits = frozen_limits(first, scatter, np.full(FIRST_SESSIONS, REPEATS), CHARTS)
    tail, k = FALSE_ALARM / CHARTS, FIRST_SESSIONS
    expected = stats.t.isf(tail / 2, k - 1) * first.std(ddof=1) * np.sqrt(1 + 1 / k)
    assert limits.half_width == pytest.approx(expected)
    f = stats.f.isf(tail, [REPEATS - 1, 1], k * (REPEATS - 1))
    found = limits.most_scatter(np.array([REPEATS, 2, 1]))
    assert found == pytest.approx([*(0.5 * np.sqrt(f)), np.nan], nan_ok=True)
    single = frozen_limits(first, np.full(k, np.nan), np.ones(k, int), CHARTS)
    assert np.isnan(single.most_scatter(np.array([REPEATS]))).all()


def test_the_scatter_is_pooled_by_degrees_of_freedom() -> None:
    k = FIRST_SESSIONS
    readings = np.array([3, 1, *[5] * (k - 2)])
    scatter = np.array([2.0, np.nan, *[1.0] * (k - 2)])
    limits = frozen_limits(np.arange(float(k)), scatter, readings, CHARTS)
    assert limits.freedom == 2 + 4 * (k - 2)
    assert limits.scatter**2 * limits.freedom == pytest.approx(2 * 4.0 + 4 * (k - 2))


def test_later_sessions_do_not_change_the_alarms_of_earlier_ones() -> None:
    values, scatter = np.random.default_rng(1).normal(0.0, 1.0, 30), np.full(30, 1.0)
    readings = np.full(30, REPEATS)
    scatter[15] = 4.0
    before = control_chart(values[:20], scatter[:20], readings[:20], CHARTS)
    readings[25] = 1
    scatter[25] = np.nan
    after = control_chart(values, scatter, readings, CHARTS)
    assert before is not None
    assert after is not None
    assert before.alarm is not None
    assert before.alarm.index == 15
    assert after.alarm == before.alarm


def test_too_few_or_equal_sessions_have_no_limits() -> None:
    values = np.arange(FIRST_SESSIONS - 1.0)
    assert control_chart(values, np.full(len(values), np.nan), np.ones(len(values), int), 1) is None
    assert control_chart(np.ones(30), np.full(30, np.nan), np.ones(30, int), 1) is None


@pytest.mark.thorough
def test_false_alarms_are_rarer_than_one_in_370_sessions_and_drift_is_found_before_3_sd() -> None:
    found, root = simulated(), np.sqrt(SENSORS)
    # Two standard deviations of a Poisson number of alarms.
    assert found.false_alarms + 2 * np.sqrt(found.false_alarms) < sum(found.sound) / 370
    assert np.mean(found.sound) - 2 * np.std(found.sound) / root > 370
    assert np.mean(found.drifting) + 2 * np.std(found.drifting) / root < FOUND_BEFORE


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_jump_is_named_with_its_rule_and_its_beginning(seed: int) -> None:
    random = np.random.default_rng(seed)
    values = random.normal(0.0, 1.0, 30)
    values[20:] += 30.0
    chart = control_chart(values, np.full(30, np.nan), np.ones(30, int), 1)
    assert chart is not None
    assert chart.alarm is not None
    assert (chart.alarm.index, chart.alarm.since) == (20, 20)
    rough = np.full(30, 1.0)
    rough[25] = 20.0
    chart = control_chart(random.normal(0.0, 1.0, 30), rough, np.full(30, REPEATS), 1)
    assert chart is not None
    assert chart.alarm is not None
    assert (chart.alarm.index, chart.alarm.rule) == (25, "scatter of the repeats")
