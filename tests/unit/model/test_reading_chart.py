"""The chart of a trial's readings."""

from __future__ import annotations

from math import hypot

import pytest

from workbench.model.reading_chart import SENSOR, error_chart
from workbench.model.trial_event import LaserRange, ReadingTaken


def reading(standoff_mm: float, range_mm: float | None, laser_mm: float) -> ReadingTaken:
    return ReadingTaken(
        trial="t",
        scene="s",
        standoff_mm=standoff_mm,
        reading=1,
        status="no_points" if range_mm is None else "done",
        range_mm=range_mm,
        sigma_mm=None if range_mm is None else 0.5,
        lasers=(LaserRange(laser_id="L1", range_mm=laser_mm, sigma_mm=1.0, u_px=None, v_px=None),),
    )


READINGS = [reading(500.0, 501.0, 495.0), reading(2000.0, None, 2010.0)]


def test_errors_are_in_percent_of_the_true_range() -> None:
    chart = error_chart("errors", READINGS)
    assert chart.y.unit == "%"
    laser, sensor = chart.series
    assert (laser.name, sensor.name) == ("L1", SENSOR)
    assert laser.x == (500.0, 2000.0)
    assert laser.y == pytest.approx((-1.0, 0.5))
    assert laser.sd == pytest.approx((0.2, 0.05))
    assert sensor.x == (500.0,)
    assert sensor.y == pytest.approx((0.2,))


def test_only_where_the_reference_is_known_is_an_error_an_outlier() -> None:
    known_reference = READINGS[0].model_copy(update={"reference_sd_mm": 0.5})
    laser, _ = error_chart("errors", [known_reference, READINGS[1]]).series
    known, unknown = laser.expected_sd
    assert known == pytest.approx(100 * hypot(1.0, 0.5) / 500)
    assert unknown is None
    assert [laser.is_outlier(i) for i in range(2)] == [True, False]
