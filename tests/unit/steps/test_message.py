"""Step `message`."""

from __future__ import annotations

from pathlib import Path

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys


def test_it_shows_its_text_and_asks_nothing(tmp_path: Path) -> None:
    step, operator = parse_step("step: message, text: Good morning."), Scripted(otherwise=None)
    assert (step.title, step.default_duration_s) == ("Good morning.", 0.0)
    assert list(step.prompts("p.1", two_laser_rig())) == []
    with running(tmp_path, operator=operator) as session:
        step.run(session.context, "p.1")
        assert session.events == []


def test_a_text_is_needed() -> None:
    assert wrong_keys("step: message") == ["steps[0].text"]
    assert wrong_keys("step: message, text: a, colour: red") == ["steps[0].colour"]
