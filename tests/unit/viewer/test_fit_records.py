"""Records of a fit of a captures file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isnan, nan
from pathlib import Path

import pytest

from workbench.calibration.verdict.records import fit_finished
from workbench.cli.fit import FittedSource, Request, fit_source
from workbench.model import event as ev
from workbench.model.captures import CaptureRow
from workbench.viewer.fit_records import fit_records

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def found() -> FittedSource:
    source, rig = ROOT / "data/webcam-laser-rows.csv", ROOT / "rigs/webcam-laser.yaml"
    return fit_source(Request(source, rig, Path(), None, ()))


def records_of(found: FittedSource, rows: Sequence[CaptureRow]) -> Iterator[ev.Record]:
    return fit_records("webcam", rows, found.fitted, fit_finished(found.fitted, found.assessment))


@pytest.fixture(scope="module")
def records(found: FittedSource) -> list[ev.Record]:
    return list(records_of(found, found.rows))


def test_records_are_numbered_from_the_start_of_a_session_to_its_end(records: list[ev.Record]) -> None:
    assert [record.n for record in records] == list(range(len(records)))
    kinds = [record.event.kind for record in records]
    assert kinds[:2] == ["session_started", "step_started"]
    assert kinds[-2:] == ["fit_finished", "session_finished"]


@pytest.mark.parametrize("u_px", [310.5, nan])
def test_each_row_is_a_capture_with_the_spot_that_it_states(found: FittedSource, u_px: float) -> None:
    """A position along one axis only is no point of the frame."""
    rows = [row.model_copy(update={"u_px": u_px}) for row in found.rows]
    events = [record.event for record in records_of(found, rows)]
    taken = [event for event in events if isinstance(event, ev.CaptureTaken)]
    spots = [event for event in events if isinstance(event, ev.SpotsFound)]
    assert [one.standoff_mm for one in taken] == [row.standoff_mm for row in rows]
    assert [one.key for one in spots] == [one.key for one in taken]
    for row, event in zip(rows, spots, strict=True):
        stated = [] if isnan(u_px) else [(row.laser_id, row.u_px, row.v_px)]
        assert [(spot.laser_id, spot.u_px, spot.v_px) for spot in event.spots] == stated


def test_captures_have_the_times_and_parts_of_their_rows(found: FittedSource) -> None:
    stated = [{"time_s": 1.5 * n, "part": "cold" if n > 4 else ""} for n in range(len(found.rows))]
    rows = [row.model_copy(update=update) for row, update in zip(found.rows, stated, strict=True)]
    events = [record.event for record in records_of(found, rows)]
    taken = [event for event in events if isinstance(event, ev.CaptureTaken)]
    assert [one.time_ns for one in taken] == [1_500_000_000 * n for n in range(len(rows))]
    assert [one.part for one in taken] == [0] * 5 + [1] * (len(rows) - 5)


def test_the_target_is_placed_once_for_each_placement(records: list[ev.Record]) -> None:
    placed: list[str] = []
    for record in records:
        if isinstance(record.event, ev.TargetPlaced):
            placed.append(record.event.placement.key)
        if isinstance(record.event, ev.CaptureTaken):
            assert record.event.placement_key == placed[-1]
    assert len(placed) == len(set(placed))
