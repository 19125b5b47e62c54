"""Drift of simulated sensors: amount, beginning, and the date at which it reaches a limit."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from tests.support.verified_sensor import FIRST, MONTH
from workbench.model.arrays import FloatArray
from workbench.report.history.drift import distance_histories
from workbench.report.history.verifications import DistanceCheck, Verification

SD = 0.001


def checked(errors: FloatArray) -> list[Verification]:
    """One verification a month at 500 mm with these mean errors."""
    return [
        Verification(
            f"s{n}",
            f"{FIRST + n * MONTH:%Y-%m-%d}",
            int((FIRST + n * MONTH).timestamp() * 1e9),
            "c",
            (DistanceCheck(500.0, float(error), SD / 5 * (1 + n % 3), 5),),
        )
        for n, error in enumerate(errors)
    ]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_sound_sensor_is_in_control(seed: int) -> None:
    (found,) = distance_histories(checked(np.random.default_rng(seed).normal(0.002, SD, 30)))
    assert found.chart is not None
    assert found.drift is None
    assert found.due is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drift_is_found_with_amount_and_beginning(seed: int) -> None:
    errors = np.random.default_rng(seed).normal(0.0, SD, 30)
    errors[15:] += 0.006
    (found,) = distance_histories(checked(errors))
    assert found.drift is not None
    assert found.drift.amount == pytest.approx(0.006, abs=3 * SD * np.sqrt(1 / 10 + 1 / 15))
    assert found.drift.since == f"{FIRST + 15 * MONTH:%Y-%m-%d}"


def test_a_slow_trend_gives_the_day_on_which_it_reaches_a_limit() -> None:
    scatter = np.random.default_rng(4).normal(0.0, SD, 16)
    per_month = 0.00025
    (found,) = distance_histories(checked(scatter + per_month * np.arange(16)))
    assert found.chart is not None
    assert found.due is not None
    edge = (found.chart.limits.centre + found.chart.limits.half_width) / per_month
    # The slope's standard deviation is SD / sqrt(sum of squared months).
    slope_sd = SD / np.sqrt(((np.arange(16) - 7.5) ** 2).sum())
    expected = FIRST + edge * MONTH
    tolerance_days = 3 * edge * 30 * slope_sd / per_month
    assert abs((found.due - expected.date()).days) < tolerance_days
    assert found.due > date(2028, 4, 1)


def test_sound_sensors_rarely_have_a_date_at_any_time() -> None:
    random = np.random.default_rng(5)
    sensors, dated = 60, 0
    for _ in range(sensors):
        sessions = checked(random.normal(0.0, SD, 36))
        dated += any(distance_histories(sessions[:count])[0].due for count in range(12, 37))
    # 25 looks at 1 in 3000 have 0.8 % together: more than 3 of 60 with a probability of 0.14 %.
    assert dated <= 3


def test_few_sessions_have_no_chart() -> None:
    (found,) = distance_histories(checked(np.random.default_rng(1).normal(0.0, SD, 9)))
    assert (found.chart, found.drift, found.due) == (None, None, None)
