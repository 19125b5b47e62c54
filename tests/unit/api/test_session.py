"""Sessions as data frames, against the journal and the tables of a recorded session."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from workbench.session.frames import read_image

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "data/session-0.1.0"


@pytest.fixture(scope="module")
def session() -> wb.Session:
    return wb.open_session(FOLDER)


@pytest.fixture(scope="module")
def events() -> list[dict[str, Any]]:
    return [json.loads(line)["event"] for line in (FOLDER / "journal.jsonl").read_text().splitlines()]


def test_captures_are_those_of_the_captures_file(session: wb.Session) -> None:
    table = pd.read_csv(FOLDER / "captures.csv")
    ours = session.captures[session.captures["purpose"] == "calibration"]
    for column in ("laser_id", "standoff_mm", "repeat", "exposure"):
        assert ours[column].tolist() == table[column].tolist()
    assert [Path(path) for path in ours["on"]] == [FOLDER.resolve() / path for path in table["on"]]
    assert ours["time"].is_monotonic_increasing


def test_spots_are_those_of_the_journal(session: wb.Session, events: list[dict[str, Any]]) -> None:
    found = [event for event in events if event["kind"] == "spots_found"]
    assert len(session.spots) == sum(len(event["spots"]) for event in found)
    assert set(session.spots["capture"]) == {event["key"] for event in found}
    assert session.spots["u_px"].between(0, session.rig.camera.width_px).all()
    assert set(session.spots.query("capture.str.contains('/L1/')")["laser_id"]) == {"L1"}


def test_residuals_and_readings_are_those_of_the_journal(
    session: wb.Session, events: list[dict[str, Any]]
) -> None:
    (fit,) = (event for event in events if event["kind"] == "fit_finished")
    (reading,) = (event for event in events if event["kind"] == "reading_taken")
    assert session.residuals.to_dict("records") == fit["residuals"]
    row = session.readings.iloc[0]
    assert row["range_mm"] == reading["range_mm"]
    assert row["error_mm"] == pytest.approx(row["range_mm"] - row["standoff_mm"])
    assert np.isnan(row["reference_sd_mm"])


def test_trial_has_the_numbers_of_its_csv_file(session: wb.Session) -> None:
    table = pd.read_csv(FOLDER / "reference.8.csv")
    ours = session.trials["reference.8"].table
    assert ours["mean_error_mm"].tolist() == pytest.approx(table["mean_error_mm"].tolist())


def test_frames_are_the_files(session: wb.Session) -> None:
    row = session.captures.iloc[0]
    on, off = session.frame(row["capture"]), session.frame(row["capture"], off=True)
    np.testing.assert_array_equal(on, read_image(Path(row["on"])))
    np.testing.assert_array_equal(off, read_image(Path(row["off"])))
    assert on.shape == (session.rig.camera.height_px, session.rig.camera.width_px)


def test_crop_has_the_spot_in_its_middle(session: wb.Session) -> None:
    spot = session.spots.iloc[0]
    crop = session.crop(spot, half_px=6)
    assert crop.shape == (13, 13)
    v, u = np.unravel_index(int(crop.argmax()), crop.shape)
    assert abs(u - 6) <= 2
    assert abs(v - 6) <= 2


def test_crop_ends_at_the_border(session: wb.Session) -> None:
    spot = session.spots.iloc[0].copy()
    spot["u_px"], spot["v_px"] = 2.0, 1.0
    assert session.crop(spot, half_px=6).shape == (8, 9)


def test_captures_for_fit_leave_standoffs_out(session: wb.Session) -> None:
    everything, fewer = session.captures_for_fit(), session.captures_for_fit(without=[1500])
    assert set(everything["standoff_mm"]) - set(fewer["standoff_mm"]) == {1500.0}
    with pytest.raises(wb.BadInputError):
        session.captures_for_fit(without=[1501])


@pytest.mark.parametrize("capture", ["", "no/such/key"])
def test_unknown_capture_is_refused(session: wb.Session, capture: str) -> None:
    with pytest.raises(wb.BadInputError):
        session.frame(capture)


def test_session_without_a_fit_has_empty_data_frames_with_columns(tmp_path: Path) -> None:
    folder = tmp_path / "session"
    folder.mkdir()
    shutil.copy(FOLDER / "session.yaml", folder)
    lines = (FOLDER / "journal.jsonl").read_text().splitlines(keepends=True)
    (folder / "journal.jsonl").write_text("".join(lines[:2]))
    session = wb.open_session(folder)
    assert session.residuals.empty
    assert "u_px" in session.residuals
    assert session.captures.empty
    assert session.trials == {}
    with pytest.raises(wb.BadInputError):
        _ = session.calibration


def test_sessions_of_a_folder_are_listed() -> None:
    listed = wb.sessions(ROOT / "data").set_index("session")
    assert listed.loc["session-0.1.0", "state"] == "finished"
    assert listed.loc["session-0.1.0", "captures"] == 7


@pytest.mark.parametrize("name", ["data/no-such-session", "data", "README.md"])
def test_a_path_that_is_no_session_is_refused(name: str) -> None:
    with pytest.raises(wb.BadInputError):
        wb.open_session(ROOT / name)
    if name != "data":
        with pytest.raises(wb.BadInputError):
            wb.sessions(ROOT / name)
