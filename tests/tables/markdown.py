"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(heading: Sequence[str], rows: Iterable[Sequence[str]], numbers_from: int = 1) -> str:
    """A table; columns from `numbers_from` on are aligned to the right.

    Raises:
        ValueError: there are no rows, as when a stored output has other words than the reader looks for.
    """
    align = ["---" if n < numbers_from else "---:" for n in range(len(heading))]
    lines = list(map(_line, rows))
    if not lines:
        raise ValueError(f"expected rows for the table {' | '.join(heading)}, got none")
    return "\n".join([_line(heading), f"|{'|'.join(align)}|", *lines])


def code_block(text: str) -> str:
    """Text as it is on a terminal."""
    return "\n".join(["```", *(line.rstrip() for line in text.rstrip().splitlines()), "```"])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")
