"""Outcome of a drive for each sensor: stops in time, too late, false, and obstacles between the beams."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import pytest

from tests.support.driven_steps import drive_step, step_record
from workbench.trials.drive.outcome import CLOSEST, NEAREST, SONAR, DriveRecord, Outcome
from workbench.trials.drive.results import (
    BODIES,
    ON_FACE,
    ONE_BODY,
    drive_results,
    error_table,
    range_errors,
    result_charts,
    result_tables,
    step_frame,
)

TOWARDS = range(400, 80, -10)
"""Clearances of a drive up to the braking distance of 84 mm."""


def outcome(
    clearances_mm: Sequence[float],
    nearest: float | None = None,
    sonar: float | None = None,
    bias: float = 0.0,
) -> tuple[DriveRecord, dict[str, Outcome]]:
    """Drive whose nearest spot reads the clearance + bias (`nearest`: this range), the sonar likewise."""
    steps = [
        step_record(n, mm, nearest_mm=nearest or mm + bias, sonar_mm=sonar or mm)
        for n, mm in enumerate(clearances_mm)
    ]
    drive = DriveRecord.of("t/d", drive_step(), ["cube"], steps)
    return drive, {one.sensor: one for one in drive.outcomes}


def test_a_stop_in_time() -> None:
    drive, found = outcome([float(mm) for mm in TOWARDS if mm >= 84])
    assert (drive.name, drive.obstacle, drive.is_met) == ("d", "cube", True)
    for sensor in (NEAREST, CLOSEST, SONAR):
        assert not found[sensor].missed
        assert not found[sensor].false_stop
        assert found[sensor].stop_mm == 250.0
        assert found[sensor].rest_mm == pytest.approx(250.0 - 84.0)


def test_an_obstacle_that_is_read_too_far_is_missed() -> None:
    drive, found = outcome([float(mm) for mm in TOWARDS if mm >= 84], bias=200.0)
    assert drive.is_met
    assert found[NEAREST].missed
    assert (found[NEAREST].stop_mm, found[NEAREST].rest_mm) == (None, 0.0)
    assert not found[SONAR].missed


def test_a_stop_far_from_everything_is_false() -> None:
    drive, found = outcome([2000.0, 1990.0], nearest=200.0)
    assert drive.obstacle == ""
    assert found[NEAREST].false_stop
    assert not found[NEAREST].missed
    assert not found[SONAR].false_stop


def test_an_obstacle_between_the_beams_is_not_met() -> None:
    steps = [step_record(n, mm, nearest_mm=3000.0, beam_mm=3000.0) for n, mm in enumerate((110.0, 90.0))]
    drive = DriveRecord.of("t/d", drive_step(), ["pole"], steps)
    assert (drive.obstacle, drive.is_met) == ("pole", False)
    assert [one.missed for one in drive.outcomes if one.sensor == NEAREST] == [True]
    assert [one.value for one in drive_results([drive])] == [0, 1, 0]


def test_a_free_way_has_no_obstacle() -> None:
    drive, found = outcome([inf, inf], nearest=5000.0, sonar=9000.0)
    assert drive.obstacle == ""
    assert found[NEAREST].rest_mm == inf
    assert "clearance (mm) at the stop: nearest spot none" in drive.text


def test_tables_charts_and_rows() -> None:
    drives = [outcome([float(mm) for mm in TOWARDS if mm >= 84], bias=b)[0] for b in (1.0, 2.0)]
    drive_table, summary, errors = result_tables("t", drives, drive_step())
    assert len(drive_table.rows) == 6
    (nearest, *_) = summary.records()
    assert (nearest["drives"], nearest["courses"], nearest["met"], nearest["missed_met"]) == (2, 2, 2, 0)
    # Clopper-Pearson: 1 - 0.025^(1/2) for none of two.
    assert nearest["missed_met_high"] == pytest.approx(1 - 0.025**0.5)
    assert {row["of"] for row in errors.records()} == {ON_FACE, ONE_BODY, "sonar"}
    frame = step_frame(drives, ["cube"], ["L1"])
    assert len(frame) == sum(len(drive.steps) for drive in drives)
    assert (frame["L1_mm"] - frame["L1_true_mm"]).unique() == pytest.approx([1.0, 2.0])
    assert [chart.name for chart in result_charts("t", drives)] == ["t-answers", "t-errors"]


def test_errors_are_classed_by_range_and_front() -> None:
    steps = [step_record(0, 1500.0, 1515.0, several=True), step_record(1, 300.0, 297.0)]
    drive = DriveRecord.of("t/d", drive_step(), ["cube"], steps)
    errors = list(range_errors([drive]))
    of = {(one.quantity, one.true_mm): one for one in errors}
    assert of[ON_FACE, 1500.0].error_mm == pytest.approx(15.0)
    assert of[ON_FACE, 1500.0].inside is False  # stated 2 mm
    assert of[BODIES, 1500.0].inside is None
    rows = {(row["of"], row["from_mm"]): row for row in error_table("t", errors).records()}
    assert rows[ON_FACE, 1000.0]["mean"] == pytest.approx(0.01)
    assert rows[ON_FACE, 200.0]["mean"] == pytest.approx(-0.01)
    assert rows[ON_FACE, 200.0]["mean_low"] is None  # one drive has no interval
