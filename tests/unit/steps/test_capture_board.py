"""Step `capture_board`."""

from __future__ import annotations

import pytest

from tests.support.ideal import ideal_rig, laser
from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.target import BoardTarget

TEXT = (
    "step: capture_board, frames: 2, repeats: 3, placings: [{standoff_mm: 300, yaw_deg: 20},"
    " {standoff_mm: 300, pitch_deg: -15, standoff_sd_mm: 2}]"
)


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("frames: 1, repeats: 1, placings: []", ["steps[0].placings"]),
        (
            "frames: 1, repeats: 1, placings: [{standoff_mm: 3, yaw_deg: 90}]",
            ["steps[0].placings[0].yaw_deg"],
        ),
        ("frames: 1, repeats: 1, placings: [{yaw_deg: 9}]", ["steps[0].placings[0].standoff_mm"]),
        ("frames: 0, repeats: 0, placings: [{standoff_mm: 3}]", ["steps[0].frames", "steps[0].repeats"]),
    ],
)
def test_placements_that_cannot_be_are_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: capture_board, {text}") == keys


def test_one_standoff_with_two_tilts_is_two_placements() -> None:
    step, rig = parse_step(TEXT), two_laser_rig()
    first, second = step.placements("p.1", rig)
    assert (first.key, second.key) == ("p.1/01-300mm", "p.1/02-300mm")
    assert first.target == BoardTarget(yaw_deg=20.0)
    assert second.target == BoardTarget(pitch_deg=-15.0)
    assert (first.standoff_sd_mm, second.standoff_sd_mm) == (None, 2.0)
    assert [prompt.key for prompt in step.prompts("p.1", rig)] == [first.key, second.key]


def test_captures_are_frames_in_room_light_and_pairs_of_each_laser() -> None:
    step = parse_step(TEXT)
    assert step.captures(two_laser_rig()) == 2 * (2 + 3 * 2)
    assert step.gives == "captures"


def test_the_band_of_the_board_lies_along_the_row_of_lasers_where_there_is_one() -> None:
    beside, above = laser("L1", 60.0), laser("L2", 0.0, 60.0)
    upright, diagonal = ideal_rig(above), ideal_rig(beside, above)
    cross = ideal_rig(beside, above, laser("L3", -60.0), laser("L4", 0.0, -60.0))
    for rig, roll_deg in ((upright, 90.0), (diagonal, 135.0), (cross, 0.0), (two_laser_rig(), 0.0)):
        rolls = {placement.target.roll_deg for placement in parse_step(TEXT).placements("p.1", rig)}
        assert rolls == {roll_deg}
