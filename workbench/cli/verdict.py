"""Verdict of a fit or a session on one screen: ACCEPTED or REFUSED, reason, action, notes in brief."""

from __future__ import annotations

import shlex
import sys
import textwrap
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Literal

import typer

from workbench.cli.brief_notes import merge_equal_kinds
from workbench.cli.console import columns
from workbench.model.contents import printable
from workbench.model.errors import LimitFailedError

Word = Literal["ACCEPTED", "REFUSED", "DONE"]
COLOURS: dict[Word, str] = {"ACCEPTED": "green", "REFUSED": "red", "DONE": "green"}
LABEL_WIDTH = 10
"""Width of the column of labels in characters."""
REMEDY = ". Do: "
"""Text between the cause and the remedy of a reason."""


class VerdictShownError(LimitFailedError):
    """A limit failed, and the verdict has been printed: the exit prints nothing more."""


@dataclass(frozen=True)
class Verdict:
    """Content of the screen."""

    word: Word
    headline: str
    """The one reason of a refusal; else the result."""
    action: str = ""
    """Remedy in words."""
    commands: Sequence[Sequence[str]] = ()
    """Commands, the recommended one first, as lists of words."""
    facts: Sequence[str] = ()
    """Further results."""
    notes: Sequence[str] = ()
    labelled: Sequence[tuple[str, str]] = field(default=())
    """Last lines with their labels: paths and commands that are never wrapped."""


def show_verdict(verdict: Verdict) -> None:
    """Print a verdict on standard error; wrapped to the terminal's width, or unwrapped for other readers."""
    with suppress(OSError):  # a closed terminal
        typer.echo(err=True)
        _print(verdict.word, verdict.headline, COLOURS[verdict.word])
        if verdict.action:
            _print("do:", verdict.action)
        for number, command in enumerate(verdict.commands):
            _print_command("or:" if number else "then:" if verdict.action else "do:", command)
        for fact in verdict.facts:
            _print("result:" if verdict.word == "REFUSED" else "", fact)
        for note in verdict.notes:
            _print("note:", note, "yellow")
        for label, text in verdict.labelled:
            typer.echo(f"{label:<{LABEL_WIDTH}}{printable(text)}", err=True)


def split_reason(reason: str) -> tuple[str, str]:
    """Cause and remedy of a reason; the remedy is empty where none is stated."""
    cause, _, remedy = reason.partition(REMEDY)
    return cause, remedy


def and_more(reasons: Sequence[str]) -> str:
    """Cause of the first reason, with the number of reasons of other kinds."""
    first, *others = merge_equal_kinds(reasons)
    more = f" (and {len(others)} more, possibly consequences; --details lists all)" if others else ""
    return first + more


def command_lines(command: Sequence[str], width: int | None) -> list[str]:
    """Command for a shell, in lines that end with a backslash where it is continued.

    Args:
        command: words of the command.
        width: longest line in characters, unless one option with its value is longer; None: a single line.
    """
    parts: list[str] = []
    for word in command:  # an option keeps its value
        if parts and not word.startswith("-"):
            parts[-1] += f" {shlex.quote(word)}"
        else:
            parts.append(shlex.quote(word))
    lines = parts[:1]
    for part in parts[1:]:
        if width is not None and len(lines[-1]) + len(part) + len("  \\") > width:
            lines[-1] += " \\"
            lines.append(f"  {part}")
        else:
            lines[-1] += f" {part}"
    return lines


def _width() -> int | None:
    """Width of the terminal; None where standard error is none."""
    return columns() if sys.stderr.isatty() else None


def _print(label: str, text: str, colour: str | None = None) -> None:
    lines, width = [printable(text)], _width()
    if width is not None:
        room = max(20, width - LABEL_WIDTH)
        lines = textwrap.wrap(lines[0], room, break_long_words=False, break_on_hyphens=False) or [""]
    bold = label in COLOURS
    shown = typer.style(f"{label:<{LABEL_WIDTH}}", fg=colour, bold=bold) if label else " " * LABEL_WIDTH
    typer.echo(shown + f"\n{' ' * LABEL_WIDTH}".join(lines), err=True)


def _print_command(label: str, command: Sequence[str]) -> None:
    width = _width()
    lines = command_lines(command, None if width is None else width - LABEL_WIDTH)
    typer.echo(f"{label:<{LABEL_WIDTH}}" + f"\n{' ' * LABEL_WIDTH}".join(map(printable, lines)), err=True)
