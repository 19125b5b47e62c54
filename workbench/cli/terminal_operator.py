"""Operator at the terminal, who answers the prompts of a procedure."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from workbench.devices.protocols import Operator
from workbench.model.contents import printable
from workbench.model.errors import AnswerNeededError, StoppedError
from workbench.model.problems import THOUSANDS
from workbench.model.prompt import Answer, Prompt
from workbench.procedure.engine.operator import NoOperator

LOOK_S = 0.1
"""Interval at which stop requests are checked while waiting for input, s."""
AWAY_S = 10.0
"""Time without a prompt after which the next one is announced by the terminal's bell and a line, s."""
ACTIONS = ("redo", "skip", "abort")


def choose_operator(
    no_input: bool,
    console: Console,
    stopping: Callable[[], str | None],
    quiet: Callable[[], AbstractContextManager[None]],
) -> Operator:
    """Operator at the terminal; `NoOperator` without a terminal, on CI, or with --no-input."""
    if no_input:
        return NoOperator("--no-input was given")
    if os.environ.get("CI"):
        return NoOperator("CI is set")
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return NoOperator("there is no terminal")
    return TerminalOperator(console, stopping, quiet)


class TerminalOperator:
    """Operator at the terminal. Input typed before a prompt is discarded."""

    def __init__(
        self,
        console: Console,
        stopping: Callable[[], str | None],
        quiet: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._console, self._stopping, self._quiet = console, stopping, quiet
        self._answered_s = time.monotonic()

    def ask(self, prompt: Prompt) -> Answer:
        """Show a prompt and wait for a valid answer.

        Raises:
            StoppedError: a stop was requested.
            AnswerNeededError: the terminal was closed, or end-of-file was typed (^D).
        """
        with self._quiet():
            if time.monotonic() - self._answered_s > AWAY_S:
                self._console.bell()
                self._console.rule(Text("your answer is needed", style="bold reverse"))
            self._show(prompt)
            while True:
                answer = self._read(prompt)
                self._answered_s = time.monotonic()
                if answer is None:
                    self._show(prompt)
                elif (wrong := prompt.refuse(answer)) is None:
                    return answer
                else:
                    self._print(wrong)

    def _show(self, prompt: Prompt) -> None:
        self._console.print(Padding(Text(prompt.do, style="bold"), (1, 0, 0, 2)))
        for text in (prompt.expect, prompt.otherwise and f"If not: {prompt.otherwise}"):
            if text:
                self._console.print(Padding(Text(text), (0, 0, 0, 2)))
        for text in (_how_to_answer(prompt), _or(prompt)):
            self._console.print(Padding(Text(text, style="dim"), (0, 0, 0, 2)))

    def _read(self, prompt: Prompt) -> Answer | None:
        """Answer as typed; None for an action that was cancelled."""
        typed = self._line(prompt)
        if typed.lower() in ACTIONS:
            return self._action(prompt, typed.lower())
        return _answer(prompt, typed)

    def _action(self, prompt: Prompt, action: str) -> Answer | None:
        answer = Answer.model_validate({"action": action})
        instead = _instead(prompt)
        if action not in instead:
            return answer
        self._print(f"Reason for {action} ({instead[action]})? It is journalled. Enter alone cancels.")
        reason = self._line(prompt)
        return answer.model_copy(update={"reason": reason}) if reason else None

    def _line(self, prompt: Prompt) -> str:
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
        self._console.print("  > ", end="")
        while True:
            if (reason := self._stopping()) is not None:
                raise StoppedError(reason)
            if select.select([sys.stdin], [], [], LOOK_S)[0]:
                break
        typed = sys.stdin.readline()
        if not typed:
            time.sleep(LOOK_S)  # the signal of a closed terminal may still be pending
            if (reason := self._stopping()) is not None:
                raise StoppedError(reason)
            raise AnswerNeededError(
                f"prompt {prompt.key}: {prompt.do} -- the terminal was closed, or end-of-file typed (^D)"
            )
        return printable(typed.strip())

    def _print(self, text: str) -> None:
        self._console.print(Padding(Text(text, style="yellow"), (0, 0, 0, 2)))


def _how_to_answer(prompt: Prompt) -> str:
    if (quantity := prompt.quantity) is not None:
        usual = "" if quantity.usual is None else f"Enter: {quantity.usual:g} {quantity.unit}; or "
        return f"{usual}type the number in {quantity.unit}, {quantity.low:g} to {quantity.high:g}"
    if prompt.choices:
        return f"type {' or '.join(prompt.choices)}"
    yes = "yes, or yes and a reason" if prompt.overrules else "yes"
    return f"type {yes}{prompt.yes and f' ({prompt.yes})'}"


def _or(prompt: Prompt) -> str:
    return "or " + ", ".join(f"{action} ({what})" for action, what in _instead(prompt).items())


def _instead(prompt: Prompt) -> dict[str, str]:
    """Actions instead of an answer, with their effects."""
    return {**{str(action): what for action, what in prompt.may.items()}, "abort": "end the session"}


def _answer(prompt: Prompt, typed: str) -> Answer:
    """Typed text as an answer, which the prompt may refuse."""
    if prompt.quantity is not None:
        if not typed and prompt.quantity.usual is not None:
            return Answer(value=prompt.quantity.usual)
        if THOUSANDS.match(typed):  # 2,200 may be 2200 or 2.2: no number, which the prompt refuses
            return Answer(value=typed)
        try:
            return Answer(value=float(typed.removesuffix(prompt.quantity.unit).replace(",", ".")))
        except ValueError:
            return Answer(value=typed)
    if prompt.choices:
        return Answer(value=typed)
    # Only `yes` confirms, not an accidental key.
    word, _, reason = typed.partition(" ")
    if prompt.overrules and word.rstrip(",:").lower() == "yes" and reason.strip():
        return Answer(reason=reason.strip())
    return Answer(value=None if typed.lower() == "yes" else typed)
