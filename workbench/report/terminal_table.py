"""Table on the terminal: at most as wide as the terminal, no number cut or wrapped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from workbench.model.table import Table
from workbench.model.table_layout import GAP, TextColumn, blocks, text_columns


@dataclass(frozen=True)
class TerminalTable:
    """Rich renderable of a table: title, columns and caption.

    Numbers are aligned to the right. A table wider than the terminal is split into blocks of columns, one
    below the other; each block repeats the first column.
    """

    table: Table

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        """Title, blocks and caption, each at most as wide as the terminal."""
        yield Text(f"\n{self.table.title}", style="bold")
        for block in blocks(text_columns(self.table), options.max_width):
            yield _rich_table(block)
        if self.table.caption:
            yield Text(self.table.caption, style="dim italic")


def _rich_table(columns: Sequence[TextColumn]) -> RichTable:
    # The box draws blanks between columns and a rule below the headings.
    table = RichTable(box=box.SIMPLE_HEAD, padding=(0, GAP - 1, 0, 0), pad_edge=False, show_edge=False)
    height = max(len(column.heading) for column in columns)
    for column in columns:
        lines = [""] * (height - len(column.heading)) + list(column.heading)
        # Text, not markup: names may contain brackets.
        table.add_column(
            Text("\n".join(lines)),
            justify="right" if column.is_number else "left",
            no_wrap=column.is_number,
            overflow="fold",
        )
    for cells in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*map(Text, cells))
    return table
