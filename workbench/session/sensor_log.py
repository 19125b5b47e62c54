"""Record of sensors, `sensors.jsonl` in the folder of sessions: notes, and the calibrations put in force."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Literal

from workbench.model.contents import read_file
from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.yamlfile import FileModel

SENSOR_LOG = "sensors.jsonl"
LARGEST_BYTES = 2**26


class SensorEntry(FileModel):
    """One line: a note, or a calibration put in force."""

    serial: str
    """Serial number of the sensor."""
    kind: Literal["note", "in_force"]
    time: str
    """ISO 8601."""
    operator: str
    text: str
    """Text of the note, or the reason for the calibration."""
    path: str = ""
    """Calibration file, relative to the folder of sessions if it is in it."""
    sha256: str = ""


def append_entry(folder: Path, entry: SensorEntry) -> None:
    """Append one line; the file is created where there is none.

    Raises:
        BadInputError: the file cannot be written.
    """
    path = folder / SENSOR_LOG
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            os.write(handle, (entry.model_dump_json() + "\n").encode())
            os.fsync(handle)
        finally:
            os.close(handle)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from None


def read_entries(folder: Path, serial: str) -> list[SensorEntry]:
    """Entries of one sensor, in order of time.

    Raises:
        BadInputError: a line is damaged.
    """
    path = folder / SENSOR_LOG
    if not path.exists():
        return []
    lines = read_file(path, "a record of sensors", LARGEST_BYTES).decode(errors="replace").splitlines()
    entries = []
    for number, line in enumerate(lines, start=1):
        try:
            entries.append(SensorEntry.model_validate_json(line))
        except ValueError:
            raise BadInputError(
                f"{path}:{number}: expected an entry of a sensor, got {short(line)}; restore the file from"
                " a copy"
            ) from None
    return [one for one in entries if one.serial == serial]
