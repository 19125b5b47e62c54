"""Table as plain text in a monospaced font, for text documents of the recording."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from workbench.model.table import Table
from workbench.model.table_layout import TextColumn, text_columns

GAP = "  "
RULE = "─"


def table_text(table: Table) -> str:
    """Text of a table: title, headings over a rule, rows, and the caption wrapped to the table's width."""
    columns = text_columns(table)
    height = max(len(column.heading) for column in columns)
    headings = [
        _line(columns, [([""] * (height - len(c.heading)) + list(c.heading))[line] for c in columns])
        for line in range(height)
    ]
    rows = [_line(columns, cells) for cells in zip(*(column.cells for column in columns), strict=True)]
    width = sum(column.width for column in columns) + len(GAP) * (len(columns) - 1)
    lines = [table.title, "", *headings, RULE * width, *rows]
    if table.caption:
        lines += ["", fill(table.caption, max(width, len(table.title)))]
    return "\n".join(lines)


def _line(columns: Sequence[TextColumn], cells: Sequence[str]) -> str:
    aligned = [
        cell.rjust(column.width) if column.is_number else cell.ljust(column.width)
        for column, cell in zip(columns, cells, strict=True)
    ]
    return GAP.join(aligned).rstrip()
