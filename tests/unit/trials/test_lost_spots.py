"""Lost spots of a trial, with causes seen and expected."""

from __future__ import annotations

from tests.support.exact import calibration_of
from tests.support.four_lasers import four_laser_rig, reading
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.target import Placement
from workbench.trials.lost_spots import lost_spots, lost_table
from workbench.trials.spot_map import SpotMap

RIG = four_laser_rig()
RIG = RIG.model_copy(update={"bench": RIG.bench.model_copy(update={"reach_mm": (40.0, 5000.0)})})
MAP = SpotMap.of_calibration(calibration_of(RIG), RIG)
IDS = ("L1", "L2", "L3", "L4")


def seen(*ids: str, **values: object) -> ReadingTaken:
    lasers = tuple(LaserRange(laser_id=i, range_mm=500, sigma_mm=1, u_px=1, v_px=1) for i in ids)
    return reading(None, range_mm=500.0 if ids else None, lasers=lasers, **values)


def at(standoff_mm: float) -> Placement:
    return Placement(key="k", standoff_mm=standoff_mm)


def test_spots_that_all_readings_have_are_not_listed() -> None:
    assert lost_spots(at(500.0), [seen(*IDS), seen(*IDS)], MAP) == []
    assert lost_table("t.1", []) == []


def test_the_cause_is_the_most_frequent_note_of_the_laser() -> None:
    notes = [("L2: no spot was seen",), ("L2: no spot was seen", "L1: cut"), ("L2: other light",)]
    readings = [seen("L1", "L3", "L4", notes=note) for note in notes]
    (lost,) = lost_spots(at(500.0), [*readings, seen(*IDS)], MAP)
    assert (lost.laser_id, lost.lost, lost.readings) == ("L2", 3, 4)
    assert (lost.cause, lost.expected) == ("no spot was seen", "")


def test_a_laser_that_was_left_off_or_blocked_is_not_lost() -> None:
    readings = [seen("L2", "L3", "L4", left_off=("L1",)), seen("L2", "L3", "L4", blocked=("L1",))]
    assert lost_spots(at(500.0), readings, MAP) == []


def test_expected_losses_are_beside_those_found() -> None:
    near = [seen("L2", "L3", notes=("L1: outside", "L4: outside"))]
    found = lost_spots(at(95.0), near, MAP)
    assert [one.laser_id for one in found] == ["L1", "L4"]
    assert all(one.expected == "outside the image" for one in found)
    assert all(one.cause == "outside" for one in found)
    (table,) = lost_table("t.1", found)
    assert table.name == "t.1-lost-spots"
    assert len(table.rows) == 2


def test_a_reading_without_any_spot_has_its_cause_for_every_laser() -> None:
    found = lost_spots(at(500.0), [seen()], MAP)
    assert [one.laser_id for one in found] == list(IDS)
    assert {one.cause for one in found} == {"no spot was seen"}
