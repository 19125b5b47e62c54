"""Tables as data: what a column is called, its unit and its format, stated once for every renderer.

A trial, a fit or a forecast returns tables. The terminal, the recording, CSV and JSON render them and know no
single one of them.
"""

from __future__ import annotations

import csv
from io import StringIO
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from workbench.model.finite import finite_or_none
from workbench.model.number_text import duration, significant, two_digits
from workbench.model.yamlfile import FileModel


def _plain(value: Any) -> Any:
    """A Python scalar in place of a numpy one, which would lose its type; None if it is not finite."""
    return finite_or_none(value.item() if hasattr(value, "item") else value)


Cell = Annotated[float | int | bool | str | None, BeforeValidator(_plain)]
"""None: there is no such number; so is one that is not finite. A bool is an alarm."""
MISSING = "-"
ALARM = "!"
DIGITS_OF = "digits of "


class Column(FileModel):
    """One column of a table."""

    key: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    """Name in CSV and JSON, with the unit as its suffix: `mean_error_mm`."""
    name: str
    """Heading for people, without the unit: `mean error`."""
    unit: str = ""
    format: str = ""
    """Python's format specification of a number: `+.2f`. Empty: the shortest text.

    `sd`: two significant digits. `digits of KEY`: as many decimals as two significant digits of the column
    KEY of the same row, its standard deviation, need. `duration`: seconds as `45 s`, `12 min` or `3.5 h`.
    """
    scale: float = 1.0
    """A number is multiplied by it for people: 100 with the unit `%`. CSV and JSON have it unscaled."""

    @property
    def sd_key(self) -> str:
        """Key of the column with this one's standard deviation; empty where the format names none."""
        return self.format.removeprefix(DIGITS_OF) if self.format.startswith(DIGITS_OF) else ""

    @property
    def heading(self) -> str:
        """Name and unit in one line."""
        return f"{self.name} ({self.unit})" if self.unit and self.name else self.name or self.unit


class Table(FileModel):
    """Rows of cells under described columns."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]
    """Names the table's file and its place in the recording."""
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""

    @model_validator(mode="after")
    def _is_rectangular(self) -> Table:
        if wrong := [row for row in self.rows if len(row) != len(self.columns)]:
            raise ValueError(f"table {self.name}: expected {len(self.columns)} cells a row, got {wrong[0]}")
        keys = {column.key for column in self.columns}
        if len(keys) != len(self.columns):
            raise ValueError(f"table {self.name}: expected columns of different keys")
        if unknown := {c.sd_key for c in self.columns if c.sd_key} - keys:
            raise ValueError(f"table {self.name}: expected a column of the key {min(unknown)}, there is none")
        return self

    def text(self, row: int, column: int) -> str:
        """A cell for people."""
        return cell_text(self, self.rows[row], column)

    def records(self) -> list[dict[str, Cell]]:
        """A mapping a row, from the columns' keys to unscaled cells: for JSON, CSV and data frames."""
        keys = [column.key for column in self.columns]
        return [dict(zip(keys, row, strict=True)) for row in self.rows]

    def is_number(self, column: int) -> bool:
        """Whether a column holds numbers, and so is aligned to the right."""
        cells = [row[column] for row in self.rows if row[column] is not None]
        return bool(cells) and not any(isinstance(cell, str | bool) for cell in cells)

    def to_csv(self) -> str:
        """The records as CSV, the columns' keys as the header; lines end with a line feed."""
        file = StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([column.key for column in self.columns])
        writer.writerows(self.rows)  # None is empty, a float as short as it reads back
        return file.getvalue()


def cell_text(table: Table, row: tuple[Cell, ...], index: int) -> str:
    """A cell as people read it: by its column's format and scale, without the unit."""
    cell = row[index]
    if cell is None:
        return MISSING
    if isinstance(cell, bool):
        return ALARM if cell else ""
    if isinstance(cell, str):
        return cell
    return _number_text(table, row, table.columns[index], cell)


def _number_text(table: Table, row: tuple[Cell, ...], column: Column, number: float) -> str:
    value = number * column.scale
    if column.format == "sd":
        return two_digits(value)
    if column.format == "duration":
        return duration(value)
    if column.sd_key:
        sd = row[[each.key for each in table.columns].index(column.sd_key)]
        return significant(value, float(sd) * column.scale) if isinstance(sd, float | int) else f"{value:g}"
    return format(value, column.format or "g")
