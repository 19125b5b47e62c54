"""Captures files of sessions: as recorded they pass, each kind of edit is named with its row."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import copied, repair
from workbench.model.errors import BadInputError
from workbench.session.capture_table import CALIBRATION_TABLE
from workbench.session.capture_table_check import check_capture_table
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
    text = text_of(DATA / session)
    check_capture_table(DATA / session, text)
    check_capture_table(DATA / session, text.replace(".0,", ",").replace("\n", "\r\n"))


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
            check_capture_table(session, "\n".join(lines) + "\n")


def test_a_repair_that_ended_before_its_fit_leaves_the_file_of_the_fit_before(tmp_path: Path) -> None:
    session = copied(tmp_path)
    repair(session, "accepted")
    check_capture_table(session, text_of(session))


def test_without_a_journal_nothing_is_compared(tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    check_capture_table(session, "laser_id\n")
