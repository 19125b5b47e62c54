"""Tables as data: name, unit and format of each column, stated once for every renderer.

Trials, fits and forecasts return tables. The terminal, the recording, CSV and JSON render any table.
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
    """Python scalar of a numpy or Python scalar; None if it is not finite."""
    return finite_or_none(value.item() if hasattr(value, "item") else value)


Cell = Annotated[float | int | bool | str | None, BeforeValidator(_plain)]
"""Value of a cell. None: no number, or one that is not finite. A bool is an alarm."""
PERCENT = 100.0
MISSING = "-"
ALARM = "!"
DIGITS_OF = "digits of "


class Column(FileModel):
    """One column of a table."""

    key: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    """Name in CSV and JSON with the unit as suffix: `mean_error_mm`."""
    name: str
    """Heading without the unit: `mean error`."""
    unit: str = ""
    format: str = ""
    """Python format specification of a number, for example `+.2f`. Empty: the shortest text.

    `sd`: two significant digits, `+sd` with its sign. `digits of KEY`: as many decimals as two significant
    digits of the standard deviation in column KEY of the same row. `duration`: seconds as `45 s`, `12 min`
    or `3.5 h`.
    """
    scale: float = 1.0
    """Factor of displayed numbers: 100 with the unit `%`. CSV and JSON contain unscaled numbers."""

    @property
    def sd_key(self) -> str:
        """Key of the column with the standard deviation of this one; empty if the format names none."""
        return self.format.removeprefix(DIGITS_OF) if self.format.startswith(DIGITS_OF) else ""

    @property
    def unscaled_unit(self) -> str:
        """Unit of the unscaled numbers: 1 for a ratio that is displayed in percent."""
        if self.scale == 1:
            return self.unit
        return "1" if (self.unit, self.scale) == ("%", PERCENT) else f"{self.unit} / {self.scale:g}"

    @property
    def heading(self) -> str:
        """Name and unit in one line."""
        return f"{self.name} ({self.unit})" if self.unit and self.name else self.name or self.unit


class Table(FileModel):
    """Table of described columns and rows of cells."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]
    """Name of the table's file and of its entity in the recording."""
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    is_detail: bool = False
    """Whether the terminal leaves the table to the recording and its CSV file."""

    @model_validator(mode="after")
    def _is_rectangular(self) -> Table:
        if wrong := [row for row in self.rows if len(row) != len(self.columns)]:
            raise ValueError(f"table {self.name}: expected {len(self.columns)} cells a row, got {wrong[0]}")
        keys = {column.key for column in self.columns}
        if len(keys) != len(self.columns):
            raise ValueError(f"table {self.name}: expected every column key once")
        if unknown := {c.sd_key for c in self.columns if c.sd_key} - keys:
            raise ValueError(f"table {self.name}: no such column: {min(unknown)}, named by a format")
        return self

    def text(self, row: int, column: int) -> str:
        """Displayed text of a cell."""
        return cell_text(self, self.rows[row], column)

    def records(self) -> list[dict[str, Cell]]:
        """One mapping per row from column keys to unscaled cells, for JSON, CSV and data frames."""
        keys = [column.key for column in self.columns]
        return [dict(zip(keys, row, strict=True)) for row in self.rows]

    def is_number(self, column: int) -> bool:
        """Whether a column contains numbers, which are aligned to the right."""
        cells = [row[column] for row in self.rows if row[column] is not None]
        return bool(cells) and not any(isinstance(cell, str | bool) for cell in cells)

    def to_csv(self) -> str:
        """Records as CSV with the column keys as header; lines end with a line feed."""
        file = StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([column.key for column in self.columns])
        writer.writerows(self.rows)  # None becomes empty, a float the shortest text that reads back equal
        return file.getvalue()


def cell_text(table: Table, row: tuple[Cell, ...], index: int) -> str:
    """Displayed text of a cell: by the format and scale of its column, without the unit."""
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
    if column.format in {"sd", "+sd"}:
        return f"{'+' if column.format == '+sd' and value > 0 else ''}{two_digits(value)}"
    if column.format == "duration":
        return duration(value)
    if column.sd_key:
        sd = row[[each.key for each in table.columns].index(column.sd_key)]
        return significant(value, float(sd) * column.scale) if isinstance(sd, float | int) else f"{value:g}"
    return format(value, column.format or "g")
