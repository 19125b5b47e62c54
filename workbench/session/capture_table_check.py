"""Comparison of a session's captures files and frames with its journal: an edited file is found."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from workbench.model import event as ev
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.session.capture_table import CALIBRATION_TABLE, COLUMNS, TRIAL_TABLE, table_row
from workbench.session.journal import JOURNAL, read_journal
from workbench.session.state import effective

LATER_COLUMNS = ("time_s", "part")
"""Columns that earlier versions did not write."""
Row = dict[str, str]


def check_capture_table(table: Path, content: str) -> None:
    """Compare a captures file of a session with the captures that the journal records for it.

    They are those before one of the session's fits or, of the trials, before the end of one of its trials.

    Args:
        table: file in the folder of a session; without a journal nothing is compared.
        content: its text.

    Raises:
        BadInputError: a line of the journal is damaged or edited, or a row differs from it; names the line.
    """
    if not (table.parent / JOURNAL).exists():
        return
    found = _differences(list(read_journal(table.parent)), content, table.name)
    if (difference := next(found)) and all(found):
        own = f"fit {table} --rig RIG -o FILE"
        if table.name == TRIAL_TABLE:
            own = f"range {table} --calibration FILE"
        raise BadInputError(
            f"{table}: {difference}; restore it from a copy, or use it as a file of your own: workbench {own}"
        )


def check_captures(table: Path, content: bytes) -> None:
    """Compare a captures file of a session, and all frames of the session, with the journal.

    Raises:
        BadInputError: see `check_capture_table` and `check_frames`.
    """
    check_capture_table(table, content.decode("utf-8-sig"))
    check_frames(table.parent)


def check_frames(session_dir: Path) -> None:
    """Compare the frames of a session's captures with the sums of their content in the journal.

    A missing frame is no error here.

    Raises:
        BadInputError: a line of the journal is damaged or edited, or a frame is another one than captured.
    """
    if not (session_dir / JOURNAL).exists():
        return
    for record in effective(list(read_journal(session_dir))):
        if not isinstance(record.event, ev.CaptureTaken):
            continue
        for frame in filter(None, (record.event.on, record.event.off)):
            path = session_dir / frame.path
            if path.is_file() and file_sha256(path) != frame.sha256:
                raise BadInputError(
                    f"{path}: expected the frame that was captured, as the journal records its sha256, got"
                    " another; restore it from a copy, or capture its placement again: workbench repair"
                    f" {session_dir} --recapture {record.event.placement_key} --reason TEXT"
                )


def _differences(records: Sequence[ev.Record], content: str, name: str) -> Iterator[str]:
    """First difference from the captures that are in effect now, then from those of each fit or trial.

    A repair that was interrupted before its fit leaves the file of the fit before.
    """
    end_event = ev.FitFinished if name == CALIBRATION_TABLE else ev.TrialFinished
    ends = [n for n, record in enumerate(records) if isinstance(record.event, end_event)]
    for end in (len(records), *reversed(ends)):
        before = effective(records[:end])
        fits = [n for n, record in enumerate(before) if isinstance(record.event, end_event)]
        last = fits[-1] if fits and end == len(records) else len(before)
        yield _difference(_expected(before[:last], name), content)


def _expected(records: Sequence[ev.Record], name: str) -> dict[str, Row]:
    """Rows of a captures file, by the path of their lit frame."""
    purpose = "calibration" if name == CALIBRATION_TABLE else "trial"
    taken = {r.event.key: r.event for r in records if isinstance(r.event, ev.CaptureTaken)}
    captures = [one for one in taken.values() if one.purpose == purpose]
    zero_ns = min((one.time_ns for one in captures), default=0)
    rows = (dict(zip(COLUMNS, table_row(one, zero_ns), strict=True)) for one in captures)
    return {row["on"]: row for row in rows}


def _difference(expected: dict[str, Row], content: str) -> str:
    """First row that differs, with what the journal records; empty if the file is as written."""
    left = dict(expected)
    for number, cells in enumerate(csv.DictReader(io.StringIO(content, newline="")), start=2):
        row = {key: value or "" for key, value in cells.items() if key}
        recorded = left.pop(row.get("on", ""), None)
        if recorded is None:
            return f"row {number}: expected a capture that the journal records, once, got {row.get('on')}"
        if column := _differing(recorded, row):
            return (
                f"row {number}, column {column}: expected {recorded.get(column) or 'nothing'}, as the journal"
                f" records, got {row.get(column) or 'nothing'}"
            )
    if left:
        return f"expected a row of {next(iter(left))}, which the journal records, got none"
    return ""


def _differing(recorded: Row, row: Row) -> str:
    """First column in which a row differs; empty if there is none."""
    names = [name for name in COLUMNS if name in row or name not in LATER_COLUMNS]
    names += [name for name in row if name not in COLUMNS]
    return next((name for name in names if not _same(recorded.get(name, ""), row.get(name, ""))), "")


def _same(a: str, b: str) -> bool:
    """Whether two cells have one text, or one number."""
    if a == b:
        return True
    try:
        return float(a) == float(b)
    except ValueError:
        return False
