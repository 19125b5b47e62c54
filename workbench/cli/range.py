"""`workbench range`."""

from __future__ import annotations

import json
from pathlib import Path

from workbench.cli.console import print_message, result_console
from workbench.cli.in_force import note_if_not_in_force, sessions_of
from workbench.cli.reading_json import plain
from workbench.model.captures import check_images, errors_name_file, parse_captures, read_captures_file
from workbench.model.errors import BadInputError
from workbench.ranging.captures import read_captures
from workbench.ranging.ranger import Ranger
from workbench.report.readings import reading_list
from workbench.sensor.usable import check_same_sensor, load_usable
from workbench.session.capture_table import CALIBRATION_TABLE, TRIAL_TABLE
from workbench.session.capture_table_check import check_captures
from workbench.session.compression import compression_notes
from workbench.session.manifest import MANIFEST, load_session_rig


def range_captures(captures: Path, calibration: Path, as_json: bool) -> None:
    """Range every scene: one line of JSON each on standard output, a list on standard error.

    Raises:
        BadInputError: a file is wrong.
    """
    ranger = Ranger(load_usable(calibration))
    note_if_not_in_force(calibration, ranger.calibration, sessions_of(captures, calibration))
    readings = []
    table = _table(captures)
    content = read_captures_file(table)
    rows = parse_captures(table, content)
    if (captures / MANIFEST).is_file():
        check_same_sensor(load_session_rig(captures), ranger.calibration)
        check_captures(table, content)
    check_images(table, rows)
    with errors_name_file(table):
        for note in compression_notes(rows):
            print_message(f"note: {note}")
        for reading in read_captures(ranger, rows):
            readings.append(reading)
            if as_json:
                print(json.dumps(plain(reading)), flush=True)
    result_console(as_json).print(reading_list(readings), highlight=False)


def _table(captures: Path) -> Path:
    """Captures file itself, or that of a session folder: of its trials, else of its calibration."""
    if not captures.is_dir():
        return captures
    tables = [captures / name for name in (TRIAL_TABLE, CALIBRATION_TABLE)]
    found = next((table for table in tables if table.is_file()), None)
    if found is None:
        raise BadInputError(
            f"{captures}: expected a captures file, or a session folder with {TRIAL_TABLE} or"
            f" {CALIBRATION_TABLE}, got a folder with neither; name the file itself"
        )
    return found
