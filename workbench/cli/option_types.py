"""Parsers of numbers on the command line, with plain error messages."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

import typer

MOST_MM = 1e6
"""Largest accepted length, as in rig and captures files."""


def whole(text: object) -> int:
    """Parse a whole number of at least 1."""
    try:
        value = int(str(text))
    except ValueError:
        value = 0
    if value < 1:
        raise typer.BadParameter(f"expected a whole number of at least 1, such as 10, got {text}")
    return value


def millimetres(least: float) -> Callable[[object], float]:
    """Parser of a length of at least `least`, mm."""

    def parse(text: object) -> float:
        try:
            value = float(str(text))
        except ValueError:
            value = -1.0
        if not (isfinite(value) and least <= value <= MOST_MM):
            raise typer.BadParameter(
                f"expected millimetres from {least:g} to {MOST_MM:g}, such as 500, got {text}"
            )
        return value

    return parse
