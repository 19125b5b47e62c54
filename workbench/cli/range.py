"""`workbench range`."""

from __future__ import annotations

import json
from pathlib import Path

from rich.console import Console

from workbench.cli.reading import plain
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.ranging.captures import read_captures
from workbench.ranging.ranger import Ranger
from workbench.report.tables import reading_table


def range_captures(captures: Path, calibration: Path, as_json: bool) -> None:
    """Range every scene; a line of JSON each on standard output, a table on standard error.

    Raises:
        BadInputError: a file is wrong.
    """
    ranger = Ranger(usable(calibration))
    readings = []
    for reading in read_captures(ranger, load_captures(captures)):
        readings.append(reading)
        if as_json:
            print(json.dumps(plain(reading)), flush=True)
    console = Console(stderr=True)
    console.print(reading_table(readings))
    for reading in readings:
        for note in reading.notes:
            console.print(f"{reading.scene}: {note}", highlight=False)


def usable(path: Path) -> Calibration:
    """Read a calibration that was accepted, or kept for a reason.

    Raises:
        BadInputError: the file is wrong, or it holds one that was refused.
    """
    calibration = load_calibration(path)
    summary = calibration.laser_ranger.fit
    if not summary.usable:
        raise BadInputError(
            f"{path}: laser_ranger.fit.verdict: expected a calibration that was accepted, got one refused"
            f" because {'; '.join(summary.reasons)}; if it must be used, fit it again with --accept REASON"
        )
    return calibration
