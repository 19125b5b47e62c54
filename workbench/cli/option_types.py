"""Options shared by commands, and parsers of their values with plain error messages."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from enum import StrEnum
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from workbench.model.text_length import LONGEST_NAME, length_error

AnswersFile = Annotated[
    Path | None,
    typer.Option(help="Answers to prompts (YAML), except those that need a person at the bench."),
]
NoInput = Annotated[
    bool, typer.Option("--no-input", help="Do not ask: an open prompt ends with exit code 6.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output.")]
View = Annotated[
    bool | None,
    typer.Option("--view/--no-view", help="Watch in the Rerun viewer. Default: if there is a display."),
]
Details = Annotated[bool, typer.Option("--details", help="Print the tables of a fit, and all its notes.")]
Sessions = Annotated[Path, typer.Option(help="Folder of sessions.")]


class FitVerdict(StrEnum):
    """Verdicts on the last fit of a session."""

    ACCEPTED = "accepted"
    EXCEPTION = "exception"
    REFUSED = "refused"
    NONE = "none"


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


def day(text: object) -> date:
    """Parse a day, as 2026-11-30."""
    try:
        return date.fromisoformat(str(text))
    except ValueError:
        raise typer.BadParameter(f"expected a day, such as 2026-11-30, got {text}") from None


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


REASON_PLACEHOLDER = "TEXT"
"""Place of a reason in printed commands, where only a person can give it."""


def reason(given: str | None) -> str | None:
    """Refuse a blank or overlong reason, the placeholder of a printed command, and text that is not UTF-8."""
    if given is not None and not given.isprintable() and _has_surrogates(given):
        raise typer.BadParameter("expected text in UTF-8, got other bytes; set the terminal to UTF-8")
    if given is not None and given.strip() in {"", REASON_PLACEHOLDER}:
        raise typer.BadParameter(f"expected a reason in words, got {given.strip() or 'a blank'}")
    if given is not None and (wrong := length_error(given)):
        raise typer.BadParameter(wrong)
    return given


def person(given: str | None) -> str | None:
    """Refuse a blank or overlong name, and text that is not UTF-8 or in several lines."""
    if given is not None and not (given.strip() and given.isprintable()):
        raise typer.BadParameter(
            "expected the name of a person in one line, got a blank or control characters"
        )
    if given is not None and (wrong := length_error(given.strip(), LONGEST_NAME)):
        raise typer.BadParameter(wrong)
    return None if given is None else given.strip()


def _has_surrogates(text: str) -> bool:
    """Whether the text contains bytes that are not UTF-8, as Python decodes arguments."""
    return any("\ud800" <= character <= "\udfff" for character in text)


OperatorName = Annotated[
    str | None,
    typer.Option(
        "--operator",
        metavar="NAME",
        callback=person,
        help="Person who does this, for the record and the certificate. Default: the account.",
    ),
]
AcceptChanges = Annotated[
    str | None,
    typer.Option(
        metavar="REASON", callback=reason, help="Continue although rig, procedures or versions changed."
    ),
]
