"""Step `verify_trial`."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig
from tests.support.steps import parse_step, wrong_keys


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("standoffs_mm: [], readings: 1", ["steps[0].standoffs_mm"]),
        ("standoffs_mm: [300, 300], readings: 1", ["steps[0]"]),
        ("standoffs_mm: [300], readings: 1, unmeasured_mm: 0", ["steps[0].unmeasured_mm"]),
    ],
)
def test_a_verification_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: verify_trial, {text}") == keys


def test_the_first_placement_is_not_measured() -> None:
    step = parse_step("step: verify_trial, standoffs_mm: [300, 600], readings: 2, reference_sd_mm: 0.2")
    first, *measured = step.placements("p.1", four_laser_rig())
    assert first.standoff_sd_mm == first.standoff_mm == 600.0
    assert [(one.standoff_mm, one.standoff_sd_mm) for one in measured] == [(300.0, 0.2), (600.0, 0.2)]
    assert len({one.key for one in (first, *measured)}) == 3
    assert step.captures(four_laser_rig()) == 6
