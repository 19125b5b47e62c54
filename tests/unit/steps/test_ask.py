"""Step `ask`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.event import Answered
from workbench.model.prompt import Answer

NUMBER = "step: ask, text: How warm?, number: {unit: C, in: [10, 50], usual: 21}"
CHOICE = "step: ask, text: Which card?, choices: [grey, white]"


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("step: ask, text: a", "steps[0]"),
        (f"{NUMBER}, choices: [b]", "steps[0]"),
        ("step: ask, text: a, choices: [b, b]", "steps[0]"),
        ("step: ask, text: a, choices: [b, Skip]", "steps[0]"),
        ("step: ask, text: a, number: {unit: C, in: [50, 10]}", "steps[0].number"),
        ("step: ask, text: a, number: {unit: C, in: [1, 5], usual: 9}", "steps[0].number"),
        ("step: ask, text: a, number: {unit: C}", "steps[0].number.in"),
    ],
)
def test_a_question_that_cannot_be_answered_is_refused(text: str, key: str) -> None:
    assert wrong_keys(text) == [key]


def test_its_one_prompt_asks_for_what_the_file_says() -> None:
    number, choice = parse_step(NUMBER), parse_step(CHOICE)
    (asked,) = number.prompts("p.1", two_laser_rig())
    quantity = asked.quantity
    assert (asked.key, asked.do) == ("p.1", number.title)
    assert (quantity.unit, quantity.low, quantity.high, quantity.usual) == ("C", 10.0, 50.0, 21.0)
    (asked,) = choice.prompts("p.2", two_laser_rig())
    assert (asked.choices, asked.quantity, asked.at_bench) == (("grey", "white"), None, False)
    assert number.default_duration_s == choice.default_duration_s == 30.0


def test_the_answer_is_journalled_and_the_outcome_has_its_unit(tmp_path: Path) -> None:
    given = Answer(value=22.5)
    with running(tmp_path, operator=Scripted({"p.1": [given]})) as session:
        assert parse_step(NUMBER).run(session.context, "p.1") == "22.5 C"
        assert session.events == [Answered(key="p.1", question="How warm?", answer=given)]
