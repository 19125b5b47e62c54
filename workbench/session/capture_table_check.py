"""Comparison of a session's captures file with its journal: an edited file is found."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.session.capture_table import CALIBRATION_TABLE, COLUMNS, table_row
from workbench.session.journal import JOURNAL, read_journal
from workbench.session.state import effective

LATER_COLUMNS = ("time_s", "part")
"""Columns that earlier versions did not write."""
Row = dict[str, str]


def check_capture_table(session_dir: Path, content: str) -> None:
    """Compare a captures file with the captures that the journal records for one of the session's fits.

    Args:
        session_dir: folder of the session; without a journal nothing is compared.
        content: text of its captures file.

    Raises:
        BadInputError: a line of the journal is damaged or edited, or a row differs from it; names the line.
    """
    if not (session_dir / JOURNAL).exists():
        return
    found = _differences(list(read_journal(session_dir)), content)
    table = session_dir / CALIBRATION_TABLE
    if (difference := next(found)) and all(found):
        raise BadInputError(
            f"{table}: {difference}; restore it from a copy, or fit it as a file of your own:"
            f" workbench fit {table} --rig RIG -o FILE"
        )


def _differences(records: Sequence[ev.Record], content: str) -> Iterator[str]:
    """First difference from the captures that are in effect now, then from those of each fit.

    A repair that was interrupted before its fit leaves the file of the fit before.
    """
    ends = [n for n, record in enumerate(records) if isinstance(record.event, ev.FitFinished)]
    for end in (len(records), *reversed(ends)):
        before = effective(records[:end])
        fits = [n for n, record in enumerate(before) if isinstance(record.event, ev.FitFinished)]
        last = fits[-1] if fits and end == len(records) else len(before)
        yield _difference(_expected(before[:last]), content)


def _expected(records: Sequence[ev.Record]) -> dict[str, Row]:
    """Rows of the captures of the calibration, by the path of their lit frame."""
    taken = {r.event.key: r.event for r in records if isinstance(r.event, ev.CaptureTaken)}
    captures = [one for one in taken.values() if one.purpose == "calibration"]
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
