"""Prompts: which answers fit."""

from __future__ import annotations

import pytest

from workbench.model.prompt import Action, Answer, Prompt, Quantity
from workbench.model.text_length import LONGEST_TEXT

NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may={"skip": "leave it out"})
CONFIRM = Prompt("safety", "Safe?", at_bench=True)


def test_a_measured_standoff_is_as_good_as_a_round_one() -> None:
    assert NUMBER.refuse(Answer(value=502.5)) is None
    assert NUMBER.refuse(Answer(value=450.0)) is None
    assert "450 to 550 mm" in (NUMBER.refuse(Answer(value=440.0)) or "")
    assert NUMBER.refuse(Answer(value="about half a metre")) is not None
    assert NUMBER.refuse(Answer()) is not None


@pytest.mark.parametrize("action", ["redo", "skip", "abort"])
def test_what_loses_data_needs_a_reason(action: Action) -> None:
    prompt = Prompt("p", "Place it.", may={"redo": "again", "skip": "leave it out"})
    assert "reason" in (prompt.refuse(Answer(action=action)) or "")
    assert prompt.refuse(Answer(action=action, reason="it slipped")) is None


def test_what_is_not_possible_here_is_refused() -> None:
    assert NUMBER.refuse(Answer(action="redo", reason="it slipped")) is not None


def test_only_yes_confirms() -> None:
    assert CONFIRM.refuse(Answer()) is None
    assert CONFIRM.refuse(Answer(value="no")) is not None
    assert CONFIRM.refuse(Answer(value="")) is not None


def test_an_overlong_reason_is_refused() -> None:
    assert NUMBER.refuse(Answer(action="skip", reason="x" * LONGEST_TEXT)) is None
    assert NUMBER.refuse(Answer(action="skip", reason="x" * (LONGEST_TEXT + 1))) is not None
    assert CONFIRM.refuse(Answer(reason="x" * (LONGEST_TEXT + 1))) is not None
