"""Reader of a file of range readings, one row a reading, of any sensor (docs/trials.md)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from math import nan
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import Field, ValidationError

from workbench.model.csvfile import check_header, parse_csv, read_csv
from workbench.model.errors import BadInputError
from workbench.model.problems import problems
from workbench.model.yamlfile import FileModel
from workbench.trials.reading_frame import COLUMNS, reading_frame

EXPECTED = "a file of readings (CSV)"
REQUIRED = ("true_mm", "measured_mm")
LARGEST_MM = 1e9
"""Largest accepted range in either direction, mm."""
FARTHEST_RATIO = 9.0
"""Largest median ratio of measured and true ranges; cm for mm give 10."""
Millimetres = Annotated[float, Field(ge=-LARGEST_MM, le=LARGEST_MM)]


class ReadingRow(FileModel):
    """One reading. Columns that the statistics do not use are not read."""

    true_mm: Annotated[Millimetres, Field(ge=0)]
    measured_mm: Millimetres = nan
    """NaN: the sensor gave no range."""
    placement: str = "1"
    repeat: Annotated[int, Field(ge=0)] | None = None
    """Order in time within the placement; None: the order of the rows."""
    session: str = "1"
    standoff_mm: Millimetres | None = None
    """Level to which the reading belongs; None: its true range."""


def load_sessions(paths: Sequence[Path]) -> pd.DataFrame:
    """Read files of readings; of several, each is a session of its own, or has those of its own column.

    Sessions of different files are different, also where they have equal labels.

    Raises:
        BadInputError: see `load_readings`; or a file is named twice.
    """
    if len(paths) == 1:
        return load_readings(paths[0])
    if len({path.resolve() for path in paths}) < len(paths):
        raise BadInputError(f"expected each file of readings once, got {', '.join(map(str, paths))}")
    frames = [load_readings(path) for path in paths]
    labelled = [
        frame.assign(session=str(path) + "/" + frame["session"].astype(str))
        for path, frame in zip(paths, frames, strict=True)
    ]
    return pd.concat(labelled, ignore_index=True)


def load_readings(path: Path) -> pd.DataFrame:
    """Read a file of readings; see `reading_frame.COLUMNS` for the columns of the result.

    Raises:
        BadInputError: the file cannot be read, a column is missing or unknown, or no reading has a range.
            Wrong values give one line each, with row and column.
    """
    number = count()
    rows = parse_csv(
        path,
        read_csv(path, EXPECTED),
        EXPECTED,
        lambda names: check_header(path, names, REQUIRED, COLUMNS),
        lambda row: _row(f"{path}: row {row.line}", next(number), row.cells),
    )
    frame = reading_frame(rows)
    if not frame["measured_mm"].count():
        raise BadInputError(f"{path}: expected at least one reading with a range, got {len(frame)} without")
    _check_unit(path, frame)
    return frame


def _check_unit(path: Path, frame: pd.DataFrame) -> None:
    """Refuse readings in another unit, and thousands separators that were read as column separators.

    Raises:
        BadInputError: the median measured range is far from the true one.
    """
    used = frame[(frame["true_mm"] > 0) & frame["measured_mm"].notna()]
    ratio = float((used["measured_mm"] / used["true_mm"]).median()) if len(used) else 1.0
    if not 1 / FARTHEST_RATIO < ratio < FARTHEST_RATIO:
        raise BadInputError(
            f"{path}: expected measured_mm near true_mm, got a median ratio of {ratio:.3g}; state both in mm,"
            " and write numbers without thousands separators (2200, not 2,200)"
        )


def _row(where: str, number: int, cells: dict[str, str]) -> dict[str, object]:
    """Row of the frame from the cells of one line.

    Raises:
        BadInputError: values are wrong; one line for each, with row and column.
    """
    given = {name: cells[name] for name in ReadingRow.model_fields if name in cells}
    try:
        row = ReadingRow.model_validate(given)
    except ValidationError as error:
        lines = [f"{where}, column {one.message}" for one in problems(ReadingRow, given, error.errors())]
        raise BadInputError("\n".join(lines)) from None
    return {
        **row.model_dump(),
        "standoff_mm": row.true_mm if row.standoff_mm is None else row.standoff_mm,
        "error_mm": row.measured_mm - row.true_mm,
        "repeat": number if row.repeat is None else row.repeat,
    }
