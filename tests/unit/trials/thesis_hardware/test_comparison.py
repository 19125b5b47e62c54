"""Rows of the comparison with the thesis."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig, reading
from workbench.model.event import ReadingTaken, TrueValues
from workbench.trials.thesis_hardware.comparison import CLAIMS, Row, compare, comparison_results


def compare_all(readings: list[ReadingTaken]) -> list[Row]:
    return compare(readings, four_laser_rig())


def flats(true_mm: float, *errors_mm: float, left_off: tuple[str, ...] = ()) -> list[ReadingTaken]:
    true = TrueValues(range_mm=true_mm, range_sd_mm=0.3)
    without = f"without-{'-'.join(left_off)}/" if left_off else ""
    scene = f"t.1/{true_mm:g}mm/{without}00"
    return [reading(true, scene=scene, range_mm=true_mm + e, left_off=left_off) for e in errors_mm]


def row(rows: list[Row], target: str, quantity: str, to_mm: float | None = None) -> Row:
    (found,) = [one for one in rows if (one.target, one.quantity, one.to_mm) == (target, quantity, to_mm)]
    return found


def test_a_row_has_the_largest_mean_error_of_its_ranges() -> None:
    readings = [*flats(400.0, 1.0, -2.0), *flats(1000.0, 3.0), *flats(4000.0, 50.0)]
    rows = compare_all(readings)
    near = row(rows, "flat", "closest range error", 2000)
    assert near.ours == pytest.approx(1.5 / 400)
    assert near.at_mm == 400.0
    assert near.ratio == pytest.approx(1.5 / 400 / 0.025)
    assert near.is_reached is True
    far = row(rows, "flat", "closest range error", 4500)
    assert far.ours == pytest.approx(50 / 4000)
    assert far.is_reached is False


def test_a_standard_deviation_is_in_the_unit_of_its_quantity() -> None:
    true = TrueValues(range_mm=300.0, range_sd_mm=0.3, angle_deg=30.0, angle_sd_deg=0.1)
    readings = [reading(true, range_mm=300.0, angle_deg=30.0 + e, angle_sd_deg=0.2) for e in (-1.0, 1.0)]
    found = row(compare_all(readings), "inclines", "angle sd")
    assert found.ours == pytest.approx(2**0.5)
    assert found.unit == "deg"
    assert found.ratio == pytest.approx(2**0.5 / 4.0)


def test_errors_with_lasers_off_are_relative_to_those_of_all_at_the_same_ranges() -> None:
    readings = [
        *flats(400.0, 1.0),
        *flats(800.0, 2.0),
        *flats(400.0, 3.0, left_off=("L1",)),
        *flats(900.0, 90.0, left_off=("L1",)),
    ]
    rows = compare_all(readings)
    one, three = row(rows, "1 off", "error / that of all"), row(rows, "3 off", "error / that of all")
    assert one.ours == pytest.approx(3.0)
    assert one.is_reached is False
    assert (three.ours, three.is_reached) == (None, False)


def inclines(true_mm: float, *angles_deg: float | None) -> list[ReadingTaken]:
    true = TrueValues(range_mm=true_mm, range_sd_mm=0.3, angle_deg=30.0, angle_sd_deg=0.1)
    sd = 0.2
    return [
        reading(true, scene=f"t.1/{true_mm:g}mm/00", range_mm=true_mm, angle_deg=deg, angle_sd_deg=deg and sd)
        for deg in angles_deg
    ]


def test_a_placement_without_the_quantity_reaches_no_goal() -> None:
    """An angle is found at 125 mm alone: the largest error of all ranges is not known."""
    readings = inclines(125.0, 30.05, 30.05)
    assert row(compare_all(readings), "30 deg", "angle error", 1000).is_reached is True
    for true_mm in (500.0, 700.0, 1000.0):
        readings += inclines(true_mm, None, None)
    found = row(compare_all(readings), "30 deg", "angle error", 1000)
    assert found.ours == pytest.approx(0.05 / 30)
    assert (found.readings, found.missing, found.lacking_mm) == (2, 6, (500.0, 700.0, 1000.0))
    assert found.is_reached is False
    results = comparison_results([found])
    assert [(one.quantity, one.value) for one in results] == [
        ("goal_ratio", None),
        ("thesis_ratio", None),
        ("goals_missed", 1.0),
    ]


def test_a_placement_without_a_range_with_lasers_off_reaches_no_goal() -> None:
    readings = [
        *flats(400.0, 1.0),
        *flats(800.0, 2.0),
        *flats(400.0, 1.0, left_off=("L1",)),
    ]
    assert row(compare_all(readings), "1 off", "error / that of all").is_reached is True
    lost = flats(800.0, 0.0, left_off=("L1",))[0].model_copy(update={"range_mm": None, "closest_mm": None})
    found = row(compare_all([*readings, lost]), "1 off", "error / that of all")
    assert (found.readings, found.missing, found.lacking_mm) == (1, 1, (800.0,))
    assert found.is_reached is False


def test_a_parabolas_difference_from_the_cylinder_is_the_size_of_its_cause() -> None:
    true = TrueValues(range_mm=400.0, range_sd_mm=0.1, radius_mm=89.0, radius_sd_mm=0.1)
    readings = [reading(true, range_mm=404.0, cylinder_mm=400.5, cylinder_sd_mm=0.5)]
    found = row(compare_all(readings), "cylinder", "closest range error")
    assert found.cause_size == pytest.approx(3.5 / 400)


def test_without_readings_no_goal_is_reached() -> None:
    rows = compare_all([])
    assert len(rows) == len(CLAIMS) + 2
    assert {one.ours for one in rows} == {None}
    assert all(one.is_reached is (None if one.goal is None else False) for one in rows)


def test_results_are_those_of_rows_with_readings() -> None:
    results = comparison_results(compare_all([*flats(400.0, 4.0), reading(None, range_mm=None)]))
    found = {(one.quantity, one.of): one.value for one in results}
    assert found["goal_ratio", "flat closest range error to 2000 mm"] == pytest.approx(0.01 / 0.005)
    assert found["thesis_ratio", "flat mean range error to 2000 mm"] is None  # its reading has no range
    assert not any("cylinder" in of for _, of in found)
    assert results[-1].quantity == "goals_missed"
    assert results[-1].value is not None
    assert results[-1].value >= 1.0
    assert [one.value for one in comparison_results(compare_all([]))] == [None]
