"""Results of a trial: CSV files, captures, journal."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.running import running
from workbench.model.captures import load_captures
from workbench.model.errors import StoppedError
from workbench.model.event import TrialFinished
from workbench.model.table import Column, Table
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.step import flat_placement
from workbench.trials.results import finish_trial, write_readings

TABLE = Table(
    name="p.1-errors",
    title="Errors",
    columns=(
        Column(key="standoff_mm", name="true", unit="mm"),
        Column(key="error_mm", name="error", format=".1f"),
    ),
    rows=((500.0, 0.123456789), (800.0, None)),
)


def test_a_table_is_a_csv_file_of_its_name_with_every_digit(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        finish_trial(session.context, "p.1", [TABLE])
        read = pd.read_csv(session.context.session_dir / "p.1-errors.csv")
        assert session.events == [TrialFinished(trial="p.1", tables=(TABLE,), charts=())]
        assert not (session.context.session_dir / "trial-captures.csv").exists()
    assert list(read.columns) == ["standoff_mm", "error_mm"]
    assert read["error_mm"][0] == 0.123456789
    assert read["error_mm"].isna().tolist() == [False, True]


def test_captures_of_the_trial_alone_are_its_captures_file(tmp_path: Path) -> None:
    placement = flat_placement("p.1", 500.0)
    with running(tmp_path) as session:
        context = session.context
        context.confirm_safety()
        context.bench.target.place(placement)
        capture_lasers(context, placement, 1)
        context.capture("p.1/500mm/00/all", context.rig.laser_ids, placement, 0, [], scene="p.1/500mm/00")
        finish_trial(context, "p.1", [])
        (row,) = load_captures(context.session_dir / "trial-captures.csv")
    assert (row.laser_id, row.scene) == ("all", "p.1/500mm/00")


def test_a_table_that_cannot_be_written_stops_the_session(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        (session.context.session_dir / "p.1-errors.csv").mkdir()
        with pytest.raises(StoppedError, match=r"p\.1-errors") as caught:
            finish_trial(session.context, "p.1", [TABLE])
        assert session.events == []
    assert caught.value.exit_code == 5


def test_readings_are_a_file_with_every_digit(tmp_path: Path) -> None:
    frame = pd.DataFrame({"measured_mm": [0.1 + 0.2, None], "session": ["Ann, B", "C"]})
    with running(tmp_path) as session:
        write_readings(session.context, "p.1", frame)
        path = session.context.session_dir / "p.1.csv"
        assert pd.read_csv(path).equals(frame)
        assert b"\r" not in path.read_bytes()
