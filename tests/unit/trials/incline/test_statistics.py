"""Statistics of the incline trial."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.four_lasers import reading
from workbench.model.event import ReadingTaken, TrueValues
from workbench.trials.incline.statistics import angle_differences, angle_lines, incline_row
from workbench.trials.targets import InclineSpec


def spec(angle_deg: float, axis: str = "vertical") -> InclineSpec:
    return InclineSpec.model_validate(
        {"kind": "incline", "angle_deg": angle_deg, "axis": axis, "reference_sd_deg": 0.1}
    )


def angles(set_deg: float, *measured_deg: float | None, sd_deg: float = 0.2) -> list[ReadingTaken]:
    true = TrueValues(range_mm=400.0, range_sd_mm=0.3, angle_deg=set_deg, angle_sd_deg=0.1)
    return [
        reading(true, range_mm=400.5, angle_deg=one, angle_sd_deg=None if one is None else sd_deg)
        for one in measured_deg
    ]


def test_a_reading_whose_shape_is_no_incline_has_no_angle() -> None:
    row = incline_row(spec(30.0), 400.0, angles(30.0, 30.4, None, 30.2))
    assert (row.range.n, row.angle.n, row.angle.missing) == (3, 2, 1)
    assert row.angle.mean == pytest.approx(0.3)
    assert row.angle.expanded == pytest.approx(2 * np.hypot(0.2, 0.1))
    assert row.range.mean == pytest.approx(0.5)


def test_the_reference_of_an_angle_is_that_of_its_reading_and_of_a_difference_that_of_the_set_angles() -> (
    None
):
    tilted = [
        one.model_copy(update={"true": one.true and one.true.model_copy(update={"angle_sd_deg": 0.5})})
        for one in angles(30.0, 30.4)
    ]
    row = incline_row(spec(30.0), 400.0, tilted)
    assert row.angle.expanded == pytest.approx(2 * np.hypot(0.2, 0.5))
    (difference,) = angle_differences([row, incline_row(spec(60.0), 400.0, angles(60.0, 60.0))])
    assert difference.expanded_deg == pytest.approx(2 * np.sqrt(2 * 0.2**2 + 2 * 0.1**2))


def test_a_tilt_common_to_two_angles_cancels_in_their_difference() -> None:
    rows = [incline_row(spec(deg), 400.0, angles(deg, deg + 0.7)) for deg in (30.0, 60.0, -10.0)]
    found = angle_differences(rows)
    assert [one.angles_deg for one in found] == [(30.0, 60.0), (30.0, -10.0), (60.0, -10.0)]
    assert [one.error_deg for one in found] == pytest.approx([0.0] * 3, abs=1e-12)
    assert found[0].expanded_deg == pytest.approx(2 * np.sqrt(2 * 0.2**2 + 2 * 0.1**2))


def test_only_angles_at_the_same_range_and_axis_are_compared() -> None:
    first = incline_row(spec(30.0), 400.0, angles(30.0, 30.0))
    others = [
        incline_row(spec(60.0), 500.0, angles(60.0, 60.0)),
        incline_row(spec(60.0, "horizontal"), 400.0, angles(60.0, 60.0)),
        incline_row(spec(60.0), 400.0, angles(60.0, None)),
    ]
    assert [angle_differences([first, other]) for other in others] == [[], [], []]


def test_a_line_through_three_angles_separates_scale_and_common_tilt() -> None:
    rows = [incline_row(spec(deg), 400.0, angles(deg, 0.7 + 1.02 * deg)) for deg in (-40.0, 20.0, 60.0)]
    (line,) = angle_lines(rows)
    assert (line.slope, line.intercept_deg) == pytest.approx((1.02, 0.7))
    assert (line.angles, line.asked_mm, line.axis) == (3, 400.0, "vertical")
    assert line.probability == pytest.approx(1.0)
    # The intercept of a line through n points has at least the uncertainty of their mean.
    assert line.intercept_sd_deg > np.hypot(0.2, 0.1) / np.sqrt(3)


def test_two_angles_have_a_difference_but_no_line() -> None:
    rows = [incline_row(spec(deg), 400.0, angles(deg, deg)) for deg in (30.0, 60.0)]
    missing = incline_row(spec(10.0), 400.0, angles(10.0, None))
    assert angle_lines([*rows, missing]) == []
