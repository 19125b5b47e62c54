"""Text of a table's columns for the terminal and the recording: wrapped headings, cells, alignment."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap

from workbench.model.contents import printable
from workbench.model.table import Table


@dataclass(frozen=True)
class TextColumn:
    """One column as text."""

    heading: tuple[str, ...]
    """Lines of the heading, wrapped to the width of the cells without breaking words."""
    cells: tuple[str, ...]
    is_number: bool

    @property
    def width(self) -> int:
        """Length of the longest line, in characters."""
        return max(map(len, (*self.heading, *self.cells)))


def text_columns(table: Table) -> tuple[TextColumn, ...]:
    """Columns of a table as text, in order."""
    return tuple(_text_column(table, index) for index in range(len(table.columns)))


def _text_column(table: Table, index: int) -> TextColumn:
    heading = table.columns[index].heading
    cells = tuple(printable(table.text(row, index)) for row in range(len(table.rows)))
    width = max(map(len, [*cells, *heading.split(), " "]))
    lines = tuple(wrap(heading, width, break_long_words=False, break_on_hyphens=False))
    return TextColumn(lines or ("",), cells, table.is_number(index))
