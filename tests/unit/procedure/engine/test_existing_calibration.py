"""A session with an existing calibration: checked, copied, journalled, resumed."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import pytest

from tests.crash.short import RESUMER, write_files
from tests.support.procedures import CALLER, story
from workbench.model import event as ev
from workbench.model.errors import BadInputError, StoppedError
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import run
from workbench.session.manifest import load_manifest

ROOT = Path(__file__).parents[4]
CALIBRATION = ROOT / "data/session-0.1.0/calibration.yaml"
"""Of the rig that `write_files` writes."""
PROCEDURE = """\
format: 1
procedure: p
title: P
steps:
  - step: accuracy_trial
    standoffs_mm: [500, 800]
    readings: 1
"""


def planned(folder: Path, procedure: str = PROCEDURE, serial: str = "emulated-1") -> Plan:
    rig, path = write_files(folder, procedure)
    rig.write_text(rig.read_text().replace("serial: emulated-1", f"serial: {serial}"))
    return Plan.load(rig, [path], CALIBRATION)


def loaded(events: list[ev.Event]) -> ev.CalibrationLoaded:
    (event,) = [event for event in events if isinstance(event, ev.CalibrationLoaded)]
    return event


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """A session that was stopped after the first of two placements."""
    finished: list[ev.Record] = []

    def see(record: ev.Record) -> None:
        if isinstance(record.event, ev.PlacementFinished):
            finished.append(record)

    with pytest.raises(StoppedError):
        run(planned(tmp_path), tmp_path / "s", [see], CALLER, lambda: "enough" if finished else None)
    return tmp_path / "s"


def test_trials_use_the_copy_also_after_a_resumption(stopped: Path) -> None:
    assert (stopped / "calibration.yaml").read_bytes() == CALIBRATION.read_bytes()
    event = loaded(story(stopped))
    assert event.file == str(CALIBRATION)
    assert load_manifest(stopped).calibration is not None
    assert event.age_days is not None
    resume(stopped, [], RESUMER, lambda: None)
    readings = [event for event in story(stopped) if isinstance(event, ev.ReadingTaken)]
    assert [reading.standoff_mm for reading in readings] == [500.0, 800.0]
    assert all(reading.range_mm is not None for reading in readings)
    assert loaded(story(stopped)) == event, "the age is that at the start"


@pytest.mark.parametrize("damage", ["changed", "missing"])
def test_a_resumption_needs_the_copy_as_it_was(stopped: Path, damage: str) -> None:
    copy = stopped / "calibration.yaml"
    if damage == "missing":
        copy.unlink()
    else:
        copy.write_bytes(copy.read_bytes() + b"# seen\n")
    with pytest.raises(BadInputError, match=str(copy)):
        resume(stopped, [], RESUMER, lambda: None)


def test_a_calibration_of_another_sensor_is_refused_before_the_session(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"calibration\.yaml: .*serial") as caught:
        planned(tmp_path, serial="emulated-9")
    assert caught.value.exit_code == 2


def test_an_export_beside_an_existing_calibration_is_refused(tmp_path: Path) -> None:
    grid = "  - {step: capture_grid, standoffs_mm: [300, 600], repeats: 1}\n"
    with pytest.raises(BadInputError, match=r"steps\[3\]: export.*--calibration"):
        planned(tmp_path, PROCEDURE + grid + "  - {step: fit}\n  - {step: export}\n")


@pytest.mark.parametrize(
    ("days_later", "zone", "known"), [(0.0, "+0000", True), (2.5, "+0000", True), (2.5, "", False)]
)
def test_the_age_is_unknown_where_a_time_has_no_zone(
    tmp_path: Path, days_later: float, zone: str, known: bool
) -> None:
    existing = planned(tmp_path).calibration
    assert existing is not None
    made = datetime.fromisoformat(existing.calibration.laser_ranger.provenance.created)
    now = (made + timedelta(days=days_later)).strftime("%Y-%m-%dT%H:%M:%S") + zone
    assert existing.loaded(now).age_days == (days_later if known else None)
