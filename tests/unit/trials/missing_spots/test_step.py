"""Step `missing_spots_trial`."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig
from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError

STEP = "step: missing_spots_trial, ranges_mm: [300, 600], readings: 4"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("missing: []", ["steps[0]"]),
        ("blocked: [2, 2]", ["steps[0]"]),
        ("blocked: [0]", ["steps[0].blocked[0]"]),
        ("missing: [0]", ["steps[0].missing[0]"]),
        ("missing: [1, 1]", ["steps[0]"]),
        ("missing: [1], target: {kind: egg}", ["steps[0].target.kind"]),
    ],
)
def test_a_trial_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"{STEP}, {text}") == keys


def test_one_laser_at_least_stays_on() -> None:
    step = parse_step(f"{STEP}, missing: [1, 3]")
    assert len(step.placements("p.1", four_laser_rig())) == 2
    with pytest.raises(BadInputError, match="missing") as caught:
        step.placements("p.1", two_laser_rig())
    assert caught.value.exit_code == 2


def test_all_lasers_are_read_too() -> None:
    step = parse_step(f"{STEP}, missing: [1, 3]")
    assert step.captures(four_laser_rig()) == 2 * 3 * 4
    assert (step.needs, step.gives) == ("calibration", "readings")


def test_beams_of_one_emitter_cannot_be_left_off_but_blocked() -> None:
    rig = four_laser_rig()
    together = tuple(laser.model_copy(update={"emitter": "grating"}) for laser in rig.lasers)
    rig = rig.model_copy(update={"lasers": together})
    with pytest.raises(BadInputError, match="emitter") as caught:
        parse_step(f"{STEP}, missing: [1]").placements("m", rig)
    assert caught.value.exit_code == 2
    assert parse_step(f"{STEP}, blocked: [1]").placements("m", rig)
