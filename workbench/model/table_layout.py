"""Text of a table's columns: wrapped headings, cells, alignment, and blocks of columns that fit a width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from textwrap import wrap

from workbench.model.contents import printable
from workbench.model.table import Table

GAP = 2
"""Number of characters between columns."""
NARROWEST_TEXT = 12
"""Minimum width of a text column in characters; below it, columns move to a further block."""


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


def blocks(columns: Sequence[TextColumn], width: int) -> list[list[TextColumn]]:
    """Split columns into the fewest blocks that are at most `width` characters wide, if possible.

    Blocks have equal numbers of columns as far as possible. Each block begins with the first column.
    """
    first, *others = columns
    for size in range(len(others), 0, -1):
        parts = [[first, *others[i : i + size]] for i in range(0, len(others), size)]
        if all(_least_width(part) <= width for part in parts):
            # Same number of blocks, with the columns distributed evenly.
            even = ceil(len(others) / len(parts))
            return [[first, *others[i : i + even]] for i in range(0, len(others), even)]
    return [[first, other] for other in others] or [[first]]


def _least_width(columns: Sequence[TextColumn]) -> int:
    return sum(map(least_column_width, columns)) + GAP * (len(columns) - 1)


def least_column_width(column: TextColumn) -> int:
    """Width to which a column can be narrowed by wrapping its texts; numbers are not wrapped."""
    if column.is_number:
        return column.width
    return min(column.width, max(NARROWEST_TEXT, *map(len, column.heading)))


def _text_column(table: Table, index: int) -> TextColumn:
    heading = table.columns[index].heading
    cells = tuple(printable(table.text(row, index)) for row in range(len(table.rows)))
    width = max(map(len, [*cells, *heading.split(), " "]))
    lines = tuple(wrap(heading, width, break_long_words=False, break_on_hyphens=False))
    return TextColumn(lines or ("",), cells, table.is_number(index))
