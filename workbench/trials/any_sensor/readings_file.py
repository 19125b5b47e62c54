"""Reader of a file of range readings, one row a reading, of any sensor (docs/trials.md)."""

from __future__ import annotations

import csv
import io
from math import nan
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, ValidationError

from workbench.model.contents import not_text
from workbench.model.csv_header import check_header
from workbench.model.errors import BadInputError
from workbench.model.problems import problems
from workbench.model.yamlfile import FileModel
from workbench.trials.reading_frame import COLUMNS, reading_frame

REQUIRED = ("true_mm", "measured_mm")
LARGEST_MM = 1e9
"""Largest accepted range in either direction, mm."""
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


def load_readings(path: Path) -> pd.DataFrame:
    """Read a file of readings; see `reading_frame.COLUMNS` for the columns of the result.

    Raises:
        BadInputError: the file cannot be read, a column is missing or unknown, or no reading has a range.
            Wrong values give one line each, with row and column.
    """
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected a file of readings (CSV): {error}") from None
    if (got := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected a file of readings (CSV), got {got}")
    rows, mistakes = [], []
    try:
        reader = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""))
        check_header(path, reader.fieldnames or [], REQUIRED, COLUMNS)
        for number, cells in enumerate(reader):
            try:
                rows.append(_row(f"{path}: row {reader.line_num}", number, cells))
            except BadInputError as error:
                mistakes.append(str(error))
    except csv.Error as error:
        raise BadInputError(f"{path}: expected a file of readings (CSV): {error}") from None
    if mistakes:
        raise BadInputError("\n".join(mistakes))
    frame = reading_frame(rows)
    if not frame["measured_mm"].count():
        raise BadInputError(f"{path}: expected at least one reading with a range, got {len(frame)} without")
    return frame


def _row(where: str, number: int, cells: dict[str | Any, str | Any]) -> dict[str, object]:
    """Row of the frame from the cells of one line.

    Raises:
        BadInputError: values are wrong; one line for each, with row and column.
    """
    if None in cells or None in cells.values():
        raise BadInputError(f"{where}: the number of values differs from the number of columns in the header")
    given = {
        name: cells[name].strip() for name in ReadingRow.model_fields if name in cells and cells[name].strip()
    }
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
