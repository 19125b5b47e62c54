"""`workbench range`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.console import Console

from workbench.model.calibration import Calibration, load_calibration
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.ranging.captures import read_captures
from workbench.ranging.ranger import Ranger, Reading
from workbench.report.tables import reading_table


def range_captures(captures: Path, calibration: Path, as_json: bool) -> None:
    """Range every scene; a line of JSON each on standard output, a table on standard error.

    Raises:
        BadInputError: a file is wrong.
    """
    ranger = Ranger(_usable(calibration))
    readings = []
    for reading in read_captures(ranger, load_captures(captures)):
        readings.append(reading)
        if as_json:
            print(json.dumps(_as_json(reading)), flush=True)
    console = Console(stderr=True)
    console.print(reading_table(readings))
    for reading in readings:
        for note in reading.notes:
            console.print(f"{reading.scene}: {note}", highlight=False)


def _usable(path: Path) -> Calibration:
    calibration = load_calibration(path)
    summary = calibration.laser_ranger.fit
    if not summary.usable:
        raise BadInputError(
            f"{path}: laser_ranger.fit.verdict: expected a calibration that was accepted, got one refused"
            f" because {'; '.join(summary.reasons)}; if it must be used, fit it again with --accept REASON"
        )
    return calibration


def _as_json(reading: Reading) -> dict[str, Any]:
    return {
        "scene": reading.scene,
        "status": reading.status,
        "closest_mm": reading.closest_mm,
        "sigma_mm": reading.sigma_mm,
        "shape": {"kind": "unknown"},
        "lasers": [
            {
                "id": laser.laser_id,
                "range_mm": laser.range_mm,
                "sigma_mm": laser.sigma_mm,
                "u_px": laser.u_px,
                "v_px": laser.v_px,
            }
            for laser in reading.lasers
        ],
        "notes": list(reading.notes),
    }
