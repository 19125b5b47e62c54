"""The world in 3D: edges of its bodies, the vehicle, beams and answers, against geometry by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.viewer_stream import COLORS, a_range, logged
from tests.viewer.session import a_rig
from workbench.model.target import WorldTarget
from workbench.model.trial_event import SensorAnswer, VehicleMoved
from workbench.model.world import Pose, Vehicle, World
from workbench.viewer.geometry import Geometry
from workbench.viewer.stream import Stream
from workbench.viewer.world_view import answer_strip, edges, log_step, log_world

STRIPS = "LineStrips3D:strips"
VEHICLE = Vehicle()
WORLD = World.model_validate(
    {
        "format": 1,
        "world": "w",
        "title": "t",
        "bodies": [
            {"kind": "plane", "name": "floor", "point_mm": [0, 0, 0], "normal": [0, 0, 1]},
            {"kind": "box", "name": "box", "at_mm": [100, 0], "size_mm": [200, 100, 50], "base_mm": 10},
            {"kind": "ramp", "name": "ramp", "at_mm": [0, 0], "length_mm": 100, "width_mm": 60,
             "angle_deg": 45, "heading_deg": 90},
            {"kind": "prism", "name": "prism", "corners_mm": [[0, 0], [50, 0], [0, 50]], "height_mm": 20},
            {"kind": "cylinder", "name": "upright", "at_mm": [0, 0], "radius_mm": 40, "length_mm": 90},
            {"kind": "cylinder", "name": "lying", "at_mm": [0, 0], "radius_mm": 40, "length_mm": 90,
             "lies": True},
            {"kind": "pole", "name": "pole", "from_mm": [1, 2, 3], "to_mm": [4, 5, 6], "diameter_mm": 9},
        ],
    }
)  # fmt: skip
EXTENT = {
    "box": ((0, -50, 10), (200, 50, 60)),
    "ramp": ((-30, -50, 0), (30, 50, 100)),
    "prism": ((0, 0, 0), (50, 50, 20)),
    "upright": ((-40, -40, 0), (40, 40, 90)),
    "lying": ((-45, -40, 0), (45, 40, 80)),
    "pole": ((1, 2, 3), (4, 5, 6)),
}


def test_edges_span_each_body() -> None:
    found = {placed.name: edges(placed) for placed in WORLD.placed()}
    assert found.pop("floor") == []
    for name, strips in found.items():
        points = np.array([point for strip in strips for point in strip])
        low, high = EXTENT[name]
        assert points.min(axis=0) == pytest.approx(np.array(low), abs=1e-9)
        assert points.max(axis=0) == pytest.approx(np.array(high), abs=1e-9)


def test_a_ramp_rises_along_its_heading() -> None:
    (ramp,) = [edges(placed) for placed in WORLD.placed() if placed.name == "ramp"]
    top = [point for strip in ramp for point in strip if point[2] > 1]
    assert {round(y) for _, y, _ in top} == {50}


def test_answers_lie_at_their_range() -> None:
    pose = Pose(x_mm=100, y_mm=0, heading_deg=90)
    front = answer_strip(pose, VEHICLE, SensorAnswer(sensor="a", range_mm=300))
    assert np.array(front) == pytest.approx(np.array([(190, 300, 60), (10, 300, 60)]))
    arc = np.array(answer_strip(pose, VEHICLE, SensorAnswer(sensor="b", range_mm=300, full_angle_deg=30)))
    assert np.hypot(arc[:, 0] - 100, arc[:, 1]) == pytest.approx(np.full(len(arc), 300.0))


def test_a_step_shows_vehicle_beams_and_answers(tmp_path: Path) -> None:
    rig = a_rig()
    geometry = Geometry.of_rig(rig)
    laser = next(iter(geometry.rays))
    event = VehicleMoved(
        trial="t",
        scene="t/d/000",
        pose=Pose(x_mm=0, y_mm=0),
        clearance_mm=500,
        answers=(SensorAnswer(sensor="closest", range_mm=500), SensorAnswer(sensor="sonar", range_mm=None)),
    )
    target = WorldTarget(world=WORLD, pose=event.pose)

    def log(stream: Stream) -> None:
        log_world(stream, target)
        log_step(stream, event, VEHICLE, [a_range(laser, 480.0)], geometry, COLORS)

    contents = logged(tmp_path, log)
    (((_, beams),)) = contents.values("/world/beams", STRIPS)
    (beam,) = beams
    x, y, *_ = geometry.rays[laser]
    assert np.array(beam)[1] == pytest.approx(np.array([480.0, -x, 60.0 - y]), abs=1.0)
    vehicle = np.array(
        [p for _, strips in contents.values("/world/vehicle", STRIPS) for s in strips for p in s]
    )
    assert (vehicle[:, 0].min(), vehicle[:, 0].max()) == (-240.0, 0.0)
    assert len(contents.values("/world/answers/closest", STRIPS)[0][1]) == 1
