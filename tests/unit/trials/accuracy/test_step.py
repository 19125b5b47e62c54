"""Step `accuracy_trial`."""

from __future__ import annotations

import pytest

from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.procedure.engine.step import COMPUTING_S


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("standoffs_mm: [], readings: 1", ["steps[0].standoffs_mm"]),
        ("standoffs_mm: [300, 300], readings: 1", ["steps[0]"]),
        ("standoffs_mm: [0], readings: 0", ["steps[0].standoffs_mm[0]", "steps[0].readings"]),
        ("standoffs_mm: [300], readings: 1, repeats: 1", ["steps[0].repeats"]),
    ],
)
def test_a_trial_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: accuracy_trial, {text}") == keys


def test_it_takes_one_capture_a_reading_with_a_calibration() -> None:
    step, rig = parse_step("step: accuracy_trial, standoffs_mm: [300, 700], readings: 5"), two_laser_rig()
    assert (step.needs, step.gives) == ("calibration", "readings")
    assert [(one.key, one.standoff_mm) for one in step.placements("p.1", rig)] == [
        ("p.1/300mm", 300.0),
        ("p.1/700mm", 700.0),
    ]
    assert step.captures(rig) == 10
    keys = ["p.1/300mm", "p.1/700mm"]
    assert [prompt.key for prompt in step.prompts("p.1", rig)] == [*keys, *(f"{key}/outside" for key in keys)]
    assert step.default_duration_s == COMPUTING_S
