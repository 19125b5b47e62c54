"""Record of sensors, `sensors.jsonl` in the folder of sessions: notes, and the calibrations put in force."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.yamlfile import FileModel
from workbench.session.appended import append_line, locked, read_lines

SENSOR_LOG = "sensors.jsonl"


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
        BadInputError: the file is damaged, or cannot be written.
    """
    path = folder / SENSOR_LOG
    with locked(path) as handle:
        _read(path)
        append_line(handle, path, entry.model_dump_json())


def read_entries(folder: Path, serial: str) -> list[SensorEntry]:
    """Entries of one sensor, in order of time.

    Raises:
        BadInputError: a line is damaged.
    """
    path = folder / SENSOR_LOG
    if not path.exists():
        return []
    return [one for one in _read(path) if one.serial == serial]


def _read(path: Path) -> list[SensorEntry]:
    entries = []
    for number, line in enumerate(read_lines(path, "a record of sensors"), start=1):
        try:
            entries.append(SensorEntry.model_validate_json(line))
        except ValueError:
            raise BadInputError(
                f"{path}:{number}: expected an entry of a sensor, got {short(line)}; restore the file from"
                " a copy"
            ) from None
    return entries
