"""Set-ups of the incline trial."""

from __future__ import annotations

from tests.support.four_lasers import four_laser_rig
from tests.support.steps import parse_step


def test_a_set_up_keeps_the_range_asked_for_beside_the_standoff() -> None:
    step = parse_step(
        "step: incline_trial, ranges_mm: [200, 400], readings: 1, targets: [{kind: incline, angle_deg: 45}]"
    )
    found = step.set_ups("p.1", four_laser_rig())
    assert [one.range_mm for one in found] == [200.0, 400.0]
    assert [one.target.angle_deg for one in found] == [45.0, 45.0]
    # At 45 degrees the optical axis meets the target 60 mm behind its near end.
    assert [round(one.placement.standoff_mm, 9) for one in found] == [260.0, 460.0]
