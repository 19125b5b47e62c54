"""Step `incline_trial`."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig
from tests.support.steps import parse_step, wrong_keys

NINE = "{kind: incline, angle_deg: 9}"
TARGETS = "targets: [{kind: incline, angle_deg: 30}, {kind: incline, angle_deg: 60}]"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (f"ranges_mm: [300, 300], readings: 1, {TARGETS}", ["steps[0]"]),
        ("ranges_mm: [300], readings: 1, targets: []", ["steps[0].targets"]),
        (
            "ranges_mm: [300], readings: 1, targets: [{kind: incline, angle_deg: 95}]",
            ["steps[0].targets[0].angle_deg"],
        ),
        (
            "ranges_mm: [300], readings: 1, targets: [{kind: incline, angle_deg: 0}]",
            ["steps[0].targets[0].angle_deg"],
        ),
        (
            f"ranges_mm: [300], readings: 1, targets: [{NINE}, {NINE}]",
            ["steps[0]"],
        ),
        (
            "ranges_mm: [300], readings: 1, targets: [{kind: cylinder, diameter_mm: 178}]",
            ["steps[0].targets[0].kind", "steps[0].targets[0].angle_deg", "steps[0].targets[0].diameter_mm"],
        ),
    ],
)
def test_a_trial_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert sorted(wrong_keys(f"step: incline_trial, {text}")) == sorted(keys)


def test_one_placement_for_each_angle_and_range() -> None:
    step, rig = (
        parse_step(f"step: incline_trial, ranges_mm: [200, 400], readings: 3, {TARGETS}"),
        four_laser_rig(),
    )
    keys = [placement.key for placement in step.placements("p.1", rig)]
    assert keys == ["p.1/v30deg-200mm", "p.1/v30deg-400mm", "p.1/v60deg-200mm", "p.1/v60deg-400mm"]
    assert step.captures(rig) == 12
    expected = [*keys, *(f"{key}/outside" for key in keys)]
    assert [prompt.key for prompt in step.prompts("p.1", rig)] == expected
    assert (step.needs, step.gives) == ("calibration", "readings")
