"""Step `round_trial`."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("ranges_mm: [300], readings: 1", ["steps[0].target"]),
        (
            "ranges_mm: [300], readings: 1, target: {kind: cylinder, diameter_mm: -5}",
            ["steps[0].target.diameter_mm"],
        ),
        ("ranges_mm: [300, 300], readings: 1, target: {kind: cylinder, diameter_mm: 178}", ["steps[0]"]),
    ],
)
def test_a_trial_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: round_trial, {text}") == keys


def test_a_cylinder_that_the_front_cannot_see_is_refused_before_the_session() -> None:
    step = parse_step(
        "step: round_trial, ranges_mm: [300], readings: 1, target: {kind: cylinder, diameter_mm: 90}"
    )
    with pytest.raises(BadInputError, match=r"diameter_mm.*90 mm") as caught:
        step.placements("p.1", four_laser_rig())
    assert caught.value.exit_code == 2


def test_the_prompt_warns_of_reflections_and_states_the_reference() -> None:
    step = parse_step(
        "step: round_trial, ranges_mm: [300, 500], readings: 2,"
        " target: {kind: cylinder, diameter_mm: 178, diameter_sd_mm: 0.25, reference_sd_mm: 0.4}"
    )
    rig = four_laser_rig()
    placing = [prompt for prompt in step.prompts("p.1", rig) if prompt.at_bench]
    assert len(placing) == 2
    for prompt in placing:
        assert {"WARNING:", "178", "0.25", "0.4"} <= set(prompt.do.split())
    assert step.captures(rig) == 4
    assert (step.needs, step.gives) == ("calibration", "readings")
