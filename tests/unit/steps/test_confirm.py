"""Step `confirm`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import StoppedError
from workbench.model.prompt import Answer

TEXT = "step: confirm, text: Open the door., expect: It is open., otherwise: Push."


def test_its_one_prompt_says_what_to_do_what_is_seen_and_what_else() -> None:
    step = parse_step(TEXT)
    (prompt,) = step.prompts("p.1", two_laser_rig())
    assert (prompt.key, prompt.do) == ("p.1", "Open the door.")
    assert (prompt.expect, prompt.otherwise) == ("It is open.", "Push.")
    assert prompt.refuse(Answer(value="no")) is not None
    assert prompt.refuse(Answer()) is None
    assert (step.title, step.default_duration_s) == ("Open the door.", 30.0)


def test_a_text_is_needed() -> None:
    assert wrong_keys("step: confirm") == ["steps[0].text"]


def test_it_waits_for_the_confirmation(tmp_path: Path) -> None:
    refused = Answer(action="abort", reason="jammed")
    operator = Scripted({"p.1": [Answer(), refused]})
    with running(tmp_path, operator=operator) as session:
        parse_step(TEXT).run(session.context, "p.1")
        assert session.kinds == ["answered"]
        with pytest.raises(StoppedError, match="jammed"):
            parse_step(TEXT).run(session.context, "p.1")
    assert operator.keys == ["p.1", "p.1"]
