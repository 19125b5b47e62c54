"""Captures files and frames of sessions: as recorded they pass, each kind of edit is named with its row."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.support.reference_session import copied, repair
from workbench.model.errors import BadInputError
from workbench.session.capture_table import CALIBRATION_TABLE, TRIAL_TABLE
from workbench.session.capture_table_check import check_capture_table, check_frames
from workbench.session.journal import JOURNAL

DATA = Path(__file__).parents[3] / "data"
FIRST, SECOND, STANDOFF = 1, 2, ",150.0,"
"""Numbers of the first rows in the file's lines, and the standoff in both."""


def text_of(session: Path) -> str:
    return (session / CALIBRATION_TABLE).read_text()


@pytest.mark.parametrize(
    "session",
    ["session-0.1.0", "sessions/20261130-085045-reference", "sessions/20261130-120758-bad-standoff"],
)
def test_a_file_as_it_was_written_passes(session: str) -> None:
    text, table = text_of(DATA / session), DATA / session / CALIBRATION_TABLE
    check_capture_table(table, text)
    check_capture_table(table, text.replace(".0,", ",").replace("\n", "\r\n"))


def test_each_edit_is_named(tmp_path: Path) -> None:
    session = copied(tmp_path)
    header, *rows = text_of(session).splitlines()
    first, others = rows[0], rows[1:]
    edits = {
        "row 2, column standoff_mm": [header, first.replace(STANDOFF, ",151.0,"), *others],
        "row 2, column laser_id": [header, first.replace("L1,", "L2,", 1), *others],
        first.split(",")[3]: [header, *others],
        "row 3: ": [header, first, first, *others],
        "row 2, column u_sd_px": [f"{header},u_sd_px", f"{first},0.5", *others],
        "row 2, column exposure": [line.rsplit(",", 2)[0] for line in (header, *rows)],
    }
    for named, lines in edits.items():
        with pytest.raises(BadInputError, match=named):
            check_capture_table(session / CALIBRATION_TABLE, "\n".join(lines) + "\n")


def test_an_edit_of_the_trials_file_is_named(tmp_path: Path) -> None:
    table = copied(tmp_path) / TRIAL_TABLE
    text = table.read_text()
    check_capture_table(table, text)
    header, first, *others = text.splitlines()
    cells = first.split(",")
    cells[1] = repr(float(cells[1]) + 1)
    with pytest.raises(BadInputError, match="row 2, column standoff_mm"):
        check_capture_table(table, "\n".join([header, ",".join(cells), *others]) + "\n")
    with pytest.raises(BadInputError, match=re.escape(cells[3])):
        check_capture_table(table, "\n".join([header, *others]) + "\n")


@pytest.mark.parametrize("table", [CALIBRATION_TABLE, TRIAL_TABLE])
def test_a_frame_that_was_replaced_is_named(tmp_path: Path, table: str) -> None:
    session = tmp_path / "session"
    shutil.copytree(DATA / "session-0.1.0", session)
    check_frames(session)
    kept = [
        frame for line in (session / table).read_text().splitlines()[1:] for frame in line.split(",")[3:5]
    ]
    frame = next(frame for frame in kept if (session / frame).is_file())
    (session / frame).write_bytes((session / frame).read_bytes() + b"x")
    with pytest.raises(BadInputError, match=f"{re.escape(frame)}: expected the frame that was captured"):
        check_frames(session)


def test_a_repair_that_ended_before_its_fit_leaves_the_file_of_the_fit_before(tmp_path: Path) -> None:
    session = copied(tmp_path)
    repair(session, "accepted")
    check_capture_table(session / CALIBRATION_TABLE, text_of(session))


def test_without_a_journal_nothing_is_compared(tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    check_capture_table(session / CALIBRATION_TABLE, "laser_id\n")
    check_frames(session)
