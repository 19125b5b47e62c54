"""Questions at the terminal, one after another, each answer checked at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import typer

from workbench.cli.console import columns, wrapped
from workbench.model.contents import printable
from workbench.model.errors import AnswerNeededError

BACK = "back"
"""Answer that returns to the previous question."""


@dataclass(frozen=True)
class Question:
    """One question."""

    key: str
    text: str
    hint: str
    """Examples, and where to find the answer."""
    check: Callable[[str, Mapping[str, str]], object]
    """Parser of the answer, given the earlier ones; raises ValueError with the reason why it is wrong."""
    default: str = ""
    """Answer of Enter alone; empty: there is none."""
    echo: Callable[[str], str] | None = None
    """Text of a valid answer with its unit, which is shown where it differs from what was typed."""


def is_interactive() -> bool:
    """Whether a person can be asked: standard input and error are a terminal, and `CI` is not set."""
    return not os.environ.get("CI") and sys.stdin.isatty() and sys.stderr.isatty()


def ask_all(questions: Sequence[Question], without: str = "") -> dict[str, str]:
    """Ask all questions in order; returns the valid answers by key.

    Args:
        questions: questions.
        without: advice for runs without an operator.

    Raises:
        AnswerNeededError: the terminal was closed, or end-of-file was typed.
    """
    given: dict[str, str] = {}
    index = 0
    _print(
        f"{len(questions)} questions. {BACK} returns to the previous one; Ctrl-C ends, nothing is written."
    )
    while index < len(questions):
        question = questions[index]
        _show(question, f"{index + 1} of {len(questions)}", given.get(question.key, question.default))
        try:
            answer = _answer(question, given)
        except EOFError:
            raise AnswerNeededError(
                f"{question.text}: expected an answer, got the end of the input; nothing was written"
                + (without and f". {without}")
            ) from None
        if answer is None:
            index = max(0, index - 1)
            continue
        given[question.key] = answer
        index += 1
    return given


def _show(question: Question, number: str, default: str) -> None:
    _print(f"\n{question.text} ({number})", bold=True)
    _print(question.hint, dim=True)
    if default:
        _print(f"Enter: {default}", dim=True)


def _answer(question: Question, given: Mapping[str, str]) -> str | None:
    """Valid answer; None to return to the previous question."""
    while True:
        typed = _line() or given.get(question.key, question.default)
        if typed.lower() == BACK:
            return None
        try:
            question.check(typed, given)
        except ValueError as wrong:
            _print(str(wrong), colour="yellow")
        else:
            if question.echo is not None and (echo := question.echo(typed)) != typed:
                _print(f"understood: {echo}", dim=True)
            return typed


def _line() -> str:
    typer.echo("> ", nl=False, err=True)
    typed = sys.stdin.readline()
    if not typed:
        raise EOFError
    return printable(typed.strip())


def _print(text: str, *, bold: bool = False, dim: bool = False, colour: str | None = None) -> None:
    with suppress(OSError):  # a closed terminal
        typer.secho(wrapped(text, columns()), err=True, bold=bold or None, dim=dim or None, fg=colour)
