"""A session's captures as the captures file that anyone can read."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable
from pathlib import Path

from workbench.model.event import CaptureTaken
from workbench.session.files import write_record

CALIBRATION_TABLE = "captures.csv"
TRIAL_TABLE = "trial-captures.csv"
COLUMNS = ("laser_id", "standoff_mm", "repeat", "on", "off", "scene")


def write_capture_table(path: Path, captures: Iterable[CaptureTaken]) -> str:
    """Write captures.csv into the session folder; returns its sha256.

    The scene of a capture of one laser is its placement: what was taken at one placing of the target shares
    that placing's error.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for capture in captures:
        off = "" if capture.off is None else capture.off.path
        scene = capture.scene or capture.placement_key
        writer.writerow(
            (capture.laser_id, repr(capture.standoff_mm), capture.repeat, capture.on.path, off, scene)
        )
    content = stream.getvalue().encode()
    write_record(path, content)
    return hashlib.sha256(content).hexdigest()
