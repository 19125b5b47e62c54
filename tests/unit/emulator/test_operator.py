"""The virtual bench's operator: answers that fit every prompt."""

from __future__ import annotations

import pytest

from workbench.emulator.operator import EmulatedOperator
from workbench.model.prompt import Prompt, Quantity


@pytest.mark.parametrize(
    ("prompt", "value"),
    [
        (Prompt("k", "Place the target"), None),
        (Prompt("k", "Read the ruler", quantity=Quantity("mm", 100.0, 300.0, usual=150.0)), 150.0),
        (Prompt("k", "Read the ruler", quantity=Quantity("mm", 100.0, 300.0)), 200.0),
        (Prompt("k", "Read the ruler", quantity=Quantity("mm", -1.0, 1.0, usual=0.0)), 0.0),
        (Prompt("k", "Which finish", choices=("matt", "mirror")), "matt"),
    ],
)
def test_the_answer_is_the_usual_one_and_fits(prompt: Prompt, value: float | str | None) -> None:
    answer = EmulatedOperator().ask(prompt)
    assert (answer.action, answer.value, answer.by) == ("done", value, "emulator")
    assert prompt.refuse(answer) is None
