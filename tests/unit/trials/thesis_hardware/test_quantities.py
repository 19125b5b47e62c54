"""Quantities of the hardware tests, and which readings belong to a test."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import reading
from workbench.model.event import TrueValues
from workbench.trials.thesis_hardware.quantities import (
    ANGLE,
    CLOSEST_RANGE,
    MEAN_RANGE,
    RADIUS,
    by_placement,
    is_incline,
    is_mean,
    is_round,
    is_without,
)

FLAT = TrueValues(range_mm=400.0, range_sd_mm=0.3)
INCLINE = FLAT.model_copy(update={"angle_deg": -30.0, "angle_sd_deg": 0.1})
ROUND = FLAT.model_copy(update={"radius_mm": 89.0, "radius_sd_mm": 0.1})
READINGS = {
    "mean": reading(None, range_mm=501.0, closest_mm=499.0),
    "flat": reading(FLAT, range_mm=401.0),
    "one off": reading(FLAT, range_mm=402.0, left_off=("L1",)),
    "incline": reading(INCLINE, range_mm=403.0, angle_deg=-31.0, angle_sd_deg=0.2),
    "round": reading(ROUND, range_mm=404.0, radius_mm=90.0, radius_sd_mm=0.5),
}


def test_every_reading_belongs_to_one_test() -> None:
    tests = {
        "mean": is_mean,
        "flat": is_without(0),
        "one off": is_without(1),
        "incline": is_incline(30),
        "round": is_round,
    }
    for name, select in tests.items():
        assert [key for key, one in READINGS.items() if select(one)] == [name]


def test_a_flat_at_an_unmeasured_standoff_belongs_to_no_test() -> None:
    """The first placement of a verification: the standoff is not measured, its uncertainty is its size."""
    unmeasured = reading(None, range_mm=530.0, reference_sd_mm=500.0)
    assert not is_mean(unmeasured)
    assert is_mean(unmeasured.model_copy(update={"reference_sd_mm": 1.0}))


def test_errors_are_measured_minus_true() -> None:
    assert MEAN_RANGE.errors([READINGS["mean"]]) == [1.0]
    assert CLOSEST_RANGE.errors([READINGS["mean"], READINGS["flat"]]) == [-1.0, 1.0]
    assert ANGLE.errors([READINGS["incline"], READINGS["flat"]]) == [-1.0, None]
    assert RADIUS.statistics([READINGS["round"]]).expanded == pytest.approx(2 * (0.5**2 + 0.1**2) ** 0.5)


def test_readings_are_grouped_by_placement_nearest_first() -> None:
    far = FLAT.model_copy(update={"range_mm": 900.0})
    readings = [
        reading(far, range_mm=901.0),
        reading(FLAT, range_mm=401.0),
        reading(FLAT, range_mm=402.0),
        reading(FLAT, range_mm=403.0, trial="t.2", scene="t.2/400mm/00"),
    ]
    groups = by_placement(readings, is_without(0), 1000.0)
    assert [[one.range_mm for one in group] for group in groups] == [[401.0, 402.0], [403.0], [901.0]]
    assert len(by_placement(readings, is_without(0), 400.0)) == 2


def test_equal_ranges_at_other_placements_are_other_groups() -> None:
    """Angles of either sign, re-placements of one step, and lasers left off in turn at one placement."""
    turned = [
        reading(
            INCLINE.model_copy(update={"angle_deg": deg}), range_mm=403.0, scene=f"t.1/v{deg:g}deg-400mm/00"
        )
        for deg in (-30.0, 30.0)
    ]
    assert len(by_placement(turned, is_incline(30), 1000.0)) == 2
    again = [reading(None, range_mm=501.0, scene=f"t.1/{number:02d}-500mm/00") for number in (1, 2)]
    assert len(by_placement(again, is_mean, 1000.0)) == 2
    off = [
        reading(FLAT, range_mm=401.0, scene=f"t.1/400mm/without-{laser}/00", left_off=(laser,))
        for laser in ("L1", "L2")
    ]
    assert len(by_placement(off, is_without(1), 1000.0)) == 1
