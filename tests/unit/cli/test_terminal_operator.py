"""A person at the terminal; what is typed is fed through a pseudo-terminal."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import nullcontext

import pytest
from rich.console import Console

from workbench.cli.terminal_operator import TerminalOperator, choose_operator
from workbench.model.errors import AnswerNeededError, StoppedError
from workbench.model.prompt import Answer, Prompt, Quantity
from workbench.procedure.engine.operator import NoOperator

NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may={"skip": "leave it out"})
STANDOFF = Prompt("p", "Read it.", quantity=Quantity("mm", 1.0, 5000.0))
CONFIRM = Prompt("safety", "Safe?")
KEEP = Prompt("a/outside", "Keep them?", overrules=True)
CHOICE = Prompt("card", "Which card?", choices=("grey", "white"))


class Typist:
    """Types the next line each time a line is asked for: what was typed before is thrown away."""

    def __init__(self, master: int) -> None:
        self.lines: list[str] = []
        self.stream = io.StringIO()
        self._master = master
        self.reason: str | None = None

    def stopping(self) -> str | None:
        """Asked before each look at the terminal: the moment to type."""
        if self.lines:
            os.write(self._master, f"{self.lines.pop(0)}\n".encode())
        return self.reason


@pytest.fixture
def typist(monkeypatch: pytest.MonkeyPatch) -> Iterator[Typist]:
    master, slave = os.openpty()
    with os.fdopen(slave, encoding="utf-8") as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        yield Typist(master)
    os.close(master)


def asked(typist: Typist, prompt: Prompt, *lines: str) -> Answer:
    typist.lines = list(lines)
    console = Console(file=typist.stream, width=80, markup=False)
    return TerminalOperator(console, typist.stopping, nullcontext).ask(prompt)


@pytest.mark.parametrize(
    ("typed", "reason"),
    [("yes", None), ("yes, the wall is at 500", "the wall is at 500"), ("YES: seen before", "seen before")],
)
def test_a_failed_check_is_overruled_with_or_without_a_reason(
    typist: Typist, typed: str, reason: str | None
) -> None:
    assert asked(typist, KEEP, "yesterday", typed) == Answer(reason=reason)


@pytest.mark.parametrize(("away_s", "rings"), [(0.0, True), (1e9, False)])
def test_a_prompt_after_a_while_without_one_rings(
    typist: Typist, monkeypatch: pytest.MonkeyPatch, away_s: float, rings: bool
) -> None:
    monkeypatch.setattr("workbench.cli.terminal_operator.AWAY_S", away_s)
    typist.lines = ["yes"]
    console = Console(file=typist.stream, width=80, markup=False, force_terminal=True)
    TerminalOperator(console, typist.stopping, nullcontext).ask(CONFIRM)
    assert ("\a" in typist.stream.getvalue()) == rings


def test_other_confirmations_have_no_reason(typist: Typist) -> None:
    assert asked(typist, CONFIRM, "yes, of course", "yes") == Answer()


@pytest.mark.parametrize(
    ("prompt", "typed", "value"),
    [
        (NUMBER, "502.5", 502.5),
        (NUMBER, "502,5mm", 502.5),
        (NUMBER, "", 500.0),
        (CONFIRM, "yes", None),
        (CONFIRM, " YES ", None),
        (CHOICE, "white", "white"),
    ],
)
def test_what_fits_is_the_answer(
    typist: Typist, prompt: Prompt, typed: str, value: float | str | None
) -> None:
    assert asked(typist, prompt, typed) == Answer(value=value)


@pytest.mark.parametrize(
    ("prompt", "wrong", "right"),
    [
        (NUMBER, "5000", "500"),
        (Prompt("p", "Read it.", quantity=Quantity("mm", 0.0, 5000.0)), "2,200", "2200"),
        (NUMBER, "half", "500"),
        (STANDOFF, "2,200", "2200"),
        (CONFIRM, "", "yes"),
        (CONFIRM, "y", "yes"),
        (CHOICE, "green", "grey"),
    ],
)
def test_what_does_not_fit_is_asked_again(typist: Typist, prompt: Prompt, wrong: str, right: str) -> None:
    answer = asked(typist, prompt, wrong, right)
    assert answer.action == "done"
    assert typist.lines == []


def test_an_action_takes_a_reason_and_a_blank_takes_it_back(typist: Typist) -> None:
    assert asked(typist, NUMBER, "skip", "no room") == Answer(action="skip", reason="no room")
    assert asked(typist, NUMBER, "abort", "", "500") == Answer(value=500.0)
    assert asked(typist, NUMBER, "redo", "500") == Answer(value=500.0), "not possible at this prompt"


def test_a_stop_ends_the_wait(typist: Typist) -> None:
    typist.reason = "stopped by SIGINT"
    with pytest.raises(StoppedError, match="SIGINT"):
        asked(typist, CONFIRM)


def test_the_end_of_the_terminal_leaves_the_question_open(typist: Typist) -> None:
    with pytest.raises(AnswerNeededError, match="safety") as caught:
        asked(typist, CONFIRM, "\x04")
    assert caught.value.exit_code == 6


def test_nobody_is_asked_without_a_terminal_on_ci_or_by_request(monkeypatch: pytest.MonkeyPatch) -> None:
    def choose(no_input: bool) -> object:
        return choose_operator(no_input, Console(file=io.StringIO()), lambda: None, nullcontext)

    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    assert isinstance(choose(False), NoOperator)
    for stream in (sys.stdin, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    assert isinstance(choose(False), TerminalOperator)
    assert isinstance(choose(True), NoOperator)
    monkeypatch.setenv("CI", "1")
    assert isinstance(choose(False), NoOperator)
