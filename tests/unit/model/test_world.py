"""World files: their schema, with the line of a mistake, and the place of objects."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.world import Frame, Pose, load_world
from workbench.procedure.engine.check import check_file

WORLDS = sorted((Path(__file__).parents[3] / "procedures/worlds").glob("*.yaml"))
GOOD = """\
format: 1
world: room
title: A room
objects:
  stool:
    - {kind: pole, name: leg, from_mm: [100, 0, 0], to_mm: [100, 0, 400], diameter_mm: 20}
bodies:
  - {kind: plane, name: wall, point_mm: [3000, 0, 0], normal: [-1, 0, 0]}
  - {kind: copy, name: stool-1, of: stool, at_mm: [1000, 500], heading_deg: 90}
"""


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_worlds_of_the_repository_are_good(path: Path) -> None:
    world = load_world(path)
    assert world.world == path.stem
    assert check_file(path).mistakes == ()
    names = [one.name for one in world.placed()]
    assert len(set(names)) == len(names)


def test_parts_of_an_object_are_placed_and_turned(tmp_path: Path) -> None:
    path = tmp_path / "room.yaml"
    path.write_text(GOOD)
    wall, leg = load_world(path).placed()
    assert (wall.name, leg.name) == ("wall", "stool-1/leg")
    assert leg.frame.point(100.0, 0.0) == pytest.approx((1000.0, 600.0))
    assert Frame(0.0, 0.0, 45.0).point(1.0, 0.0) == pytest.approx((sqrt(0.5), sqrt(0.5)))


@pytest.mark.parametrize(
    ("was", "now", "line", "text"),
    [
        ("of: stool", "of: chair", 7, "stool-1: expected an object of this file (stool), got chair"),
        ("name: stool-1", "name: wall", 7, "expected distinct names, got wall more than once"),
        ("diameter_mm: 20", "diameter_mm: 0", 6, "objects.stool[0].diameter_mm"),
        ("to_mm: [100, 0, 400]", "to_mm: [100, 0, 0]", 6, "expected another point than from_mm"),
        ("normal: [-1, 0, 0]", "normal: [0, 0, 0]", 8, "expected a direction"),
        ("kind: plane", "kind: ball", 8, "ball"),
        ("heading_deg: 90", "headng_deg: 90", 9, "headng_deg"),
    ],
)
def test_a_mistake_is_named_with_its_line(tmp_path: Path, was: str, now: str, line: int, text: str) -> None:
    path = tmp_path / "room.yaml"
    path.write_text(GOOD.replace(was, now))
    with pytest.raises(BadInputError) as raised:
        load_world(path)
    assert f"{path}:{line}: " in str(raised.value)
    assert text in str(raised.value)
    assert check_file(path).mistakes


@pytest.mark.parametrize(
    "corners", ["[[0, 0], [0, 100], [100, 0]]", "[[0, 0], [100, 0], [50, 20], [50, 100]]"]
)
def test_a_prism_is_convex_and_anticlockwise(tmp_path: Path, corners: str) -> None:
    path = tmp_path / "room.yaml"
    prism = f"  - {{kind: prism, name: p, height_mm: 100, corners_mm: {corners}}}\n"
    path.write_text(GOOD + prism)
    with pytest.raises(BadInputError, match="convex polygon, anticlockwise"):
        load_world(path)


def test_pose_ahead_keeps_its_heading() -> None:
    pose = Pose(x_mm=10.0, y_mm=20.0, heading_deg=90.0).ahead(100.0)
    assert (pose.x_mm, pose.y_mm, pose.heading_deg) == pytest.approx((10.0, 120.0, 90.0))
