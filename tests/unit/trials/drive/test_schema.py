"""Paths, brakes."""

from __future__ import annotations

import pytest

from workbench.model.world import Pose
from workbench.trials.drive.schema import Brakes, Drive

START = {"x_mm": 0, "y_mm": 0, "heading_deg": 90}


def test_a_straight_drive_has_even_steps() -> None:
    poses = Drive.model_validate({"name": "d", "start": START, "distance_mm": 35}).poses(10.0)
    assert [pose.y_mm for pose in poses] == pytest.approx([0, 10, 20, 30])
    assert {pose.heading_deg for pose in poses} == {90.0}


def test_a_path_reaches_every_pose_and_turns_the_short_way() -> None:
    path = [{"x_mm": 0, "y_mm": 25, "heading_deg": 90}, {"x_mm": 0, "y_mm": 45, "heading_deg": -170}]
    poses = Drive.model_validate({"name": "d", "start": START, "path": path}).poses(10.0)
    assert [pose.y_mm for pose in poses] == pytest.approx([0, 10, 20, 25, 35, 45])
    assert [pose.heading_deg for pose in poses] == pytest.approx([90, 90, 90, 90, 140, 190])
    assert isinstance(poses[-1], Pose)


@pytest.mark.parametrize("way", [{}, {"distance_mm": 10, "path": [{"x_mm": 1, "y_mm": 1}]}])
def test_a_drive_has_one_way(way: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="distance_mm or path, not both"):
        Drive.model_validate({"name": "d", "start": START, **way})


def test_a_path_goes_on() -> None:
    with pytest.raises(ValueError, match="different places, got 0, 0 twice"):
        Drive.model_validate({"name": "d", "start": START, "path": [START]})


def test_braking_distance() -> None:
    """0.3 m/s: 39 mm before the brakes, v^2 / 2a = 45 mm with them."""
    assert Brakes().distance_mm == pytest.approx(39.0 + 45.0)
    assert Brakes(speed_mm_s=600, reaction_s=0, deceleration_mm_s2=2000).distance_mm == pytest.approx(90.0)
