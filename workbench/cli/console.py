"""Messages on standard error, results on standard output."""

from __future__ import annotations

import os
import sys
import textwrap
import warnings
from contextlib import suppress
from typing import TYPE_CHECKING

import typer

from workbench.model.contents import printable

if TYPE_CHECKING:
    from rich.console import Console


def print_message(message: str, red: bool = False) -> None:
    """Print a message, wrapped at words on a terminal, otherwise unchanged so that `grep` finds it."""
    with suppress(OSError):  # a closed terminal
        shown = printable(message)
        text = wrapped(shown, columns()) if sys.stderr.isatty() else shown
        typer.secho(text, err=True, fg="red" if red else None, bold=red or None)


def result_console(as_json: bool = False) -> Console:
    """Console for the tables of a result: standard output, or standard error where JSON is printed there."""
    from rich.console import Console  # `--help` does without

    return Console(stderr=as_json, markup=False)


def print_warnings_as_notes() -> None:
    """Show Python's warnings as one line each, without the place in the code."""
    warnings.showwarning = lambda message, *_unused: print_message(f"note: {message}")


def wrapped(message: str, width: int) -> str:
    """Message with long lines wrapped and their indentation kept; words, such as paths, are not broken."""
    return "\n".join(_wrapped(line, width) for line in message.split("\n"))


def columns() -> int:
    """Width of the terminal on standard error in characters, unless the variable COLUMNS is set."""
    given = os.environ.get("COLUMNS", "")
    if given.isdigit() and int(given):
        return int(given)
    return os.get_terminal_size(sys.stderr.fileno()).columns or 80


def _wrapped(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.fill(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
