"""Remarks on readings: missing ranges and errors outside their interval."""

from __future__ import annotations

from math import hypot

import pytest

from tests.support.four_lasers import reading
from workbench.model.event import TrueValues
from workbench.model.reading_text import reading_remark
from workbench.model.trial_event import COVERAGE_FACTOR

TRUE = TrueValues(range_mm=400.0, range_sd_mm=0.3)
HALF_MM = COVERAGE_FACTOR * hypot(0.5, 0.3)


@pytest.mark.parametrize(("sd", "marked"), [(-1.01, True), (-0.99, False), (0.99, False), (1.01, True)])
def test_an_error_outside_its_interval_is_marked(sd: float, marked: bool) -> None:
    one = reading(TRUE, range_mm=400.0 + sd * HALF_MM)
    assert one.is_outside is marked
    assert bool(reading_remark(one)) is marked


def test_the_sensors_own_interval_is_used_where_it_has_one() -> None:
    one = reading(TRUE, range_mm=398.0, low_mm=397.5, high_mm=400.5)
    assert not one.is_outside
    assert one.interval_mm == pytest.approx(
        (398.0 - hypot(0.5, COVERAGE_FACTOR * 0.3), 398.0 + hypot(2.5, COVERAGE_FACTOR * 0.3))
    )
    endless = reading(TRUE, range_mm=100.0, low_mm=99.0)
    assert endless.interval_mm is not None
    assert endless.interval_mm[1] == float("inf")
    assert not endless.is_outside


def test_without_a_reference_no_error_is_marked() -> None:
    assert reading_remark(reading(TRUE, range_mm=500.0, reference_sd_mm=None)) == ""


@pytest.mark.parametrize(
    ("values", "cause"),
    [
        ({"notes": ("L1: no spot was seen",)}, "L1: no spot was seen"),
        ({}, "no spot was seen"),
        ({"status": "not_enough_points"}, "too few spots could be assigned to lasers"),
    ],
)
def test_a_missing_range_is_shown_with_its_cause(values: dict[str, object], cause: str) -> None:
    one = reading(TRUE, left_off=("L2",)).model_copy(update=values)
    assert one.cause == cause
    assert cause in reading_remark(one)
    assert "L2" in reading_remark(one)


@pytest.mark.parametrize("key", ["left_off", "blocked"])
def test_lasers_without_a_spot_are_named(key: str) -> None:
    one = reading(TRUE).model_copy(update={key: ("L2", "L3")})
    assert "(L2, L3 " in reading_remark(one)
