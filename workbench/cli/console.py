"""One message on standard error."""

from __future__ import annotations

import os
import sys
import textwrap
from contextlib import suppress

import typer


def say(message: str, red: bool = False) -> None:
    """Print it: on a terminal wrapped on words, elsewhere line for line as it is, so that `grep` finds it."""
    with suppress(OSError):  # a terminal that was closed
        told = wrapped(message, columns()) if sys.stderr.isatty() else message
        typer.secho(told, err=True, fg="red" if red else None, bold=red or None)


def wrapped(message: str, width: int) -> str:
    """Each of its lines in as many as it takes, indented as it is; no word, such as a path, is broken."""
    return "\n".join(_wrapped(line, width) for line in message.split("\n"))


def columns() -> int:
    """Of the terminal that standard error is, unless COLUMNS says otherwise."""
    told = os.environ.get("COLUMNS", "")
    return (
        int(told) if told.isdigit() and int(told) else os.get_terminal_size(sys.stderr.fileno()).columns or 80
    )


def _wrapped(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.fill(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
