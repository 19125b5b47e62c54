"""Step `place_target`."""

from __future__ import annotations

from pathlib import Path

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.event import TargetPlaced
from workbench.model.prompt import Answer

TEXT = "step: place_target, standoff_mm: 500"


def test_it_gives_a_target_at_one_placement_without_captures() -> None:
    step, rig = parse_step(TEXT), two_laser_rig()
    assert (step.needs, step.gives) == (None, "target")
    assert [(one.key, one.standoff_mm) for one in step.placements("p.1", rig)] == [("p.1/500mm", 500.0)]
    assert [prompt.key for prompt in step.prompts("p.1", rig)] == ["p.1/500mm"]
    assert step.captures(rig) == 0
    assert "500 mm" in step.title


def test_a_standoff_is_positive_and_at_most_a_kilometre() -> None:
    for standoff in ("0", "-5", ".nan", "1000001"):
        assert wrong_keys(f"step: place_target, standoff_mm: {standoff}") == ["steps[0].standoff_mm"]


def test_the_target_stands_where_the_ruler_says(tmp_path: Path) -> None:
    with running(tmp_path, operator=Scripted({"p.1/500mm": [Answer(value=503.0)]})) as session:
        assert "503" in parse_step(TEXT).run(session.context, "p.1")
        (placed,) = [event for event in session.events if isinstance(event, TargetPlaced)]
        assert "exposure_set" not in session.kinds
    assert placed.placement.standoff_mm == 503.0


def test_it_may_be_left_out(tmp_path: Path) -> None:
    skip = Answer(action="skip", reason="no room")
    with running(tmp_path, operator=Scripted({"p.1/500mm": [skip]})) as session:
        parse_step(TEXT).run(session.context, "p.1")
        assert "target_placed" not in session.kinds
