"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(heading: Sequence[str], rows: Iterable[Sequence[str]], numbers_from: int = 1) -> str:
    """A table; columns from `numbers_from` on are aligned to the right."""
    align = ["---" if n < numbers_from else "---:" for n in range(len(heading))]
    lines = [_line(heading), f"|{'|'.join(align)}|", *map(_line, rows)]
    return "\n".join(lines)


def code_block(text: str) -> str:
    """Text as it is on a terminal."""
    return "\n".join(["```", *(line.rstrip() for line in text.rstrip().splitlines()), "```"])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")
