"""Writer of a session's captures as a captures file (docs/captures-format.md)."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.session.files import write_record

if TYPE_CHECKING:  # a fit of a captures file needs a name from here and no events
    from workbench.model.event import CaptureTaken

CALIBRATION_TABLE = "captures.csv"
TRIAL_TABLE = "trial-captures.csv"
NEEDED = ("laser_id", "standoff_mm", "repeat", "on", "off", "scene")
COLUMNS = (*NEEDED, "standoff_sd_mm", "exposure", "exposure_unit", "time_s", "part")
"""All columns. Those that are not needed are written only if a capture has a value for them."""


def write_capture_table(path: Path, captures: Iterable[CaptureTaken]) -> str:
    """Write a captures file into the session folder; returns its sha256.

    The scene of a calibration capture is its placement: captures at one placement share its error. Times
    count from the first capture of the file.
    """
    taken = list(captures)
    zero_ns = first_time_ns(taken)
    rows = [table_row(capture, zero_ns) for capture in taken]
    stated = [n < len(NEEDED) or any(row[n] for row in rows) for n in range(len(COLUMNS))]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerows(compress(row, stated) for row in (COLUMNS, *rows))
    content = stream.getvalue().encode()
    write_record(path, content)
    return hashlib.sha256(content).hexdigest()


def first_time_ns(captures: Iterable[CaptureTaken]) -> int:
    """Zero of `time_s` in a captures file: the time of the first capture; 0 without captures."""
    return min((capture.time_ns for capture in captures), default=0)


def table_row(capture: CaptureTaken, zero_ns: int) -> tuple[str, ...]:
    """Cells of a capture in the order of `COLUMNS`; times count from `zero_ns`."""
    return (
        capture.laser_id,
        repr(capture.standoff_mm),
        str(capture.repeat),
        capture.on.path,
        "" if capture.off is None else capture.off.path,
        capture.scene or capture.placement_key,
        "" if capture.standoff_sd_mm is None else repr(capture.standoff_sd_mm),
        "" if capture.exposure is None else repr(capture.exposure),
        capture.exposure_unit or "",
        repr(seconds_after(zero_ns, capture)),
        part_name(capture),
    )


def seconds_after(zero_ns: int, capture: CaptureTaken) -> float:
    """`time_s` of a capture."""
    return (capture.time_ns - zero_ns) / 1e9


def part_name(capture: CaptureTaken) -> str:
    """`part` of a capture; empty in a session without interruption, and in the first part of others."""
    return str(capture.part) if capture.part else ""
