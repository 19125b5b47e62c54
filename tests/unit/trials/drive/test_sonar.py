"""First echoes in closed form: walls, poles, edges of the cone, surfaces that reflect the sound away."""

from __future__ import annotations

from math import cos, hypot, radians, tan
from typing import Any

import pytest

from workbench.model.world import Pose, Vehicle, World
from workbench.trials.drive.schema import Sonar
from workbench.trials.drive.sonar import SonarView
from workbench.trials.drive.surroundings import Surroundings

AT = Pose(x_mm=0, y_mm=0)


def echo(*bodies: dict[str, Any], sonar: Sonar | None = None) -> float | None:
    world = World.model_validate({"format": 1, "world": "w", "title": "t", "bodies": list(bodies)})
    return SonarView(sonar or Sonar(), Surroundings(world), Vehicle()).echo_mm(AT)


def wall(x_mm: float, turn_deg: float = 0.0) -> dict[str, Any]:
    return {
        "kind": "plane",
        "name": "wall",
        "point_mm": [x_mm, 0, 0],
        "normal": [-1, tan(radians(turn_deg)), 0],
    }


def pole(x: float, y: float, diameter: float = 12.0) -> dict[str, Any]:
    ends = {"from_mm": [x, y, 0], "to_mm": [x, y, 500]}
    return {"kind": "pole", "name": f"pole-{y:g}", "diameter_mm": diameter, **ends}


def test_a_wall_across_answers_its_distance() -> None:
    assert echo(wall(2000.0)) == pytest.approx(2000.0)


def test_a_turned_wall_answers_its_nearest_point_until_the_cone_loses_it() -> None:
    # The foot of the perpendicular is 10 deg from the axis, within the cone of 15; rays are 1.5 deg apart.
    assert echo(wall(2000.0, 10.0)) == pytest.approx(2000.0 * cos(radians(10)), rel=4e-4)


def test_a_wall_turned_too_far_returns_no_echo() -> None:
    """At 45 deg the steepest ray of the cone has 30 deg of incidence: more than 25, less than 35."""
    assert echo(wall(2000.0, 45.0)) is None
    assert echo(wall(2000.0, 45.0), sonar=Sonar(specular_deg=35)) is not None


@pytest.mark.parametrize(("aside_mm", "is_seen"), [(0.0, True), (260.0, True), (290.0, False)])
def test_a_thin_pole_answers_anywhere_in_the_cone(aside_mm: float, is_seen: bool) -> None:
    """At 1000 mm the cone reaches 268 mm aside; the axis of the pole counts."""
    found = echo(pole(1000.0, aside_mm), wall(3000.0))
    expected = hypot(1000.0, aside_mm) - 6.0 if is_seen else 3000.0
    assert found == pytest.approx(expected, abs=1.0)


def test_limits_of_the_range() -> None:
    assert echo(wall(40.0)) == 150.0
    assert echo(wall(11_000.0)) is None


def test_the_floor_is_too_oblique_to_answer() -> None:
    floor = {"kind": "plane", "name": "floor", "point_mm": [0, 0, 0], "normal": [0, 0, 1]}
    assert echo(floor) is None
