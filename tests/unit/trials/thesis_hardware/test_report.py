"""Tables and figures of the comparison."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.support.four_lasers import reading
from workbench.model.event import TrueValues
from workbench.trials.thesis_hardware.causes import PARABOLA, TILT, Cause
from workbench.trials.thesis_hardware.comparison import Row
from workbench.trials.thesis_hardware.report import figures, goal_table, readings_table, reason, side_by_side

ROW = Row("33", "flat", "mean range error", "%", 2000.0, 0.025, 0.004, 0.005, 400.0, 0.006)
MISSED = replace(ROW, ours=0.0055)


def test_relative_errors_are_in_percent_and_others_in_their_unit() -> None:
    table = side_by_side(
        "t", [ROW, replace(ROW, quantity="mean range sd", unit="mm", thesis=40.0, ours=10.0)]
    )
    first, second = table.records()
    assert (first["thesis"], first["ours"], first["goal"]) == pytest.approx((2.5, 0.4, 0.5))
    assert (second["thesis"], second["ours"], second["ratio"]) == pytest.approx((40.0, 10.0, 0.25))
    assert first["reached"] == "yes"


def test_a_goal_that_is_not_reached_is_listed_with_its_reason() -> None:
    assert goal_table("t", [ROW, replace(MISSED, goal=None)]) == []
    (table,) = goal_table("t", [ROW, MISSED])
    (record,) = table.records()
    assert (record["ours"], record["goal"], record["expanded"]) == pytest.approx((0.55, 0.5, 0.6))
    assert record["reason"] == reason(MISSED)


def test_reasons_differ_by_the_uncertainty_at_the_range() -> None:
    beyond = replace(MISSED, ours=0.007)
    missing = replace(MISSED, ours=None)
    ratio = replace(MISSED, expanded=None)
    lacking = replace(MISSED, ours=0.001, lacking_mm=(500.0, 700.0))
    reasons = [reason(one) for one in (MISSED, beyond, missing, ratio, lacking)]
    assert len(set(reasons)) == 5
    assert "500, 700 mm" in reasons[4]


@pytest.mark.parametrize(
    ("ours", "cause", "size", "named"),
    [
        (0.0055, TILT, 0.001, True),  # within U, and the goal would be reached without the cause
        (0.0055, TILT, 0.0001, False),  # too small
        (0.0055, TILT, None, False),  # of unknown size
        (0.5, TILT, 1.0, False),  # beyond U, which includes the cause
        (0.007, PARABOLA, 0.002, True),  # beyond U, which does not include the cause
        (0.5, PARABOLA, 0.002, False),  # far beyond U
    ],
)
def test_a_cause_is_named_only_where_its_size_explains_the_excess(
    ours: float, cause: Cause, size: float | None, named: bool
) -> None:
    """The goal is 0.5 %, U 0.6 %."""
    row = replace(MISSED, ours=ours, cause=cause, cause_size=size)
    assert (cause.text in reason(row)) is named
    assert named or reason(row) == reason(replace(MISSED, ours=ours))


def test_the_table_has_the_number_of_readings_the_missing_ones_and_u() -> None:
    (record,) = readings_table("t", [replace(ROW, readings=70, missing=5)]).records()
    assert (record["readings"], record["missing"]) == (70, 5)
    assert record["expanded"] == pytest.approx(0.6)


def test_a_figure_has_mean_maximum_and_minimum_of_the_absolute_error() -> None:
    true = TrueValues(range_mm=400.0, range_sd_mm=0.3, radius_mm=89.0, radius_sd_mm=0.1)
    readings = [reading(true, range_mm=400.0 + e) for e in (-2.0, 4.0)]
    error, sd = figures("t", readings)
    assert [series.name for series in error.series] == ["mean", "maximum", "minimum"]
    assert [series.y[0] for series in error.series] == pytest.approx([0.75, 1.0, 0.5])
    assert sd.series[0].y[0] == pytest.approx(6.0 / 2**0.5)
