"""Table as plain text in a monospaced font, for text documents of the recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill, wrap

from workbench.model.table import Table
from workbench.model.table_layout import GAP, TextColumn, blocks, least_column_width, text_columns

RULE = "─"
WIDTH = 80
"""Largest width in characters: that of the narrowest panel of tables in a window of 1280 x 720 pixels."""


def table_text(table: Table) -> str:
    """Text of a table: title, headings over a rule, rows, and the caption.

    A wide table is split into blocks of columns as on the terminal.
    """
    parts = ["\n".join(_block(block)) for block in blocks(text_columns(table), WIDTH)]
    width = max(len(line) for part in parts for line in part.splitlines())
    texts = [fill(table.title, WIDTH), *parts]
    if table.caption:
        texts.append(fill(table.caption, min(WIDTH, max(width, len(table.title)))))
    return "\n\n".join(texts)


def _block(columns: Sequence[TextColumn]) -> Iterator[str]:
    """Lines of one block."""
    widths = _widths(columns)
    height = max(len(column.heading) for column in columns)
    yield from _lines(columns, widths, [("",) * (height - len(c.heading)) + c.heading for c in columns])
    yield RULE * (sum(widths) + GAP * (len(columns) - 1))
    for cells in zip(*(column.cells for column in columns), strict=True):
        wrapped = [
            [cell] if len(cell) <= width else wrap(cell, width)
            for cell, width in zip(cells, widths, strict=True)
        ]
        yield from _lines(columns, widths, wrapped)


def _widths(columns: Sequence[TextColumn]) -> list[int]:
    """Widths of columns; of a block that is too wide, the widest texts are wrapped."""
    widths = [column.width for column in columns]
    least = [least_column_width(column) for column in columns]
    while (excess := sum(widths) + GAP * (len(widths) - 1) - WIDTH) > 0 and widths != least:
        widest = max(range(len(widths)), key=lambda n: widths[n] - least[n])
        widths[widest] = max(least[widest], widths[widest] - excess)
    return widths


def _lines(
    columns: Sequence[TextColumn], widths: Sequence[int], cells: Sequence[Sequence[str]]
) -> Iterator[str]:
    """Lines of one row, whose cells have one or more lines each."""
    for n in range(max(map(len, cells))):
        texts = [lines[n] if n < len(lines) else "" for lines in cells]
        aligned = [
            text.rjust(width) if column.is_number else text.ljust(width)
            for column, width, text in zip(columns, widths, texts, strict=True)
        ]
        yield (" " * GAP).join(aligned).rstrip()
