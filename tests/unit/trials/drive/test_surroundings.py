"""Truth of a drive: closed forms, and the independent intersections of the virtual bench."""

from __future__ import annotations

from math import cos, radians, sin, sqrt, tan
from pathlib import Path

import numpy as np
import pytest

from workbench.emulator.world import WorldBodies, entry
from workbench.model.world import Pose, Vehicle, World, load_world
from workbench.trials.drive.surroundings import Surroundings, vehicle_frame, world_rays

WORLDS = sorted((Path(__file__).parents[4] / "procedures/worlds").glob("*.yaml"))
ODD = World.model_validate(
    {
        "format": 1,
        "world": "odd",
        "title": "Every kind of body, turned",
        "objects": {
            "group": [
                {"kind": "cylinder", "name": "log", "at_mm": [300, 0], "radius_mm": 80, "length_mm": 500,
                 "lies": True, "heading_deg": 30},
                {"kind": "pole", "name": "leaning", "from_mm": [0, 0, 0], "to_mm": [100, 50, 400],
                 "diameter_mm": 30},
            ]
        },
        "bodies": [
            {"kind": "plane", "name": "sloping", "point_mm": [0, 3000, 0], "normal": [0.2, -1, 0.1]},
            {"kind": "prism", "name": "prism", "height_mm": 150,
             "corners_mm": [[0, 0], [300, 50], [200, 250]]},
            {"kind": "ramp", "name": "ramp", "at_mm": [-700, 200], "length_mm": 400, "width_mm": 300,
             "angle_deg": 25, "heading_deg": 40},
            {"kind": "copy", "name": "group-1", "of": "group", "at_mm": [700, -400], "heading_deg": 70},
        ],
    }
)  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("world", [*map(load_world, WORLDS), ODD], ids=lambda world: world.world)
def test_two_ways_of_intersecting_agree(world: World, seed: int) -> None:
    """Triangles and quadrics against half spaces, on rays from points outside of all bodies."""
    rng = np.random.default_rng(seed)
    origins = rng.uniform((-1500, -1500, 10), (6000, 2800, 400), (2000, 3))
    directions = rng.normal(size=(2000, 3)) * (1, 1, 0.2)
    bodies = WorldBodies(world, 0.8)
    spans = [body.span(origins, directions) for body in bodies.bodies]
    inside = np.any([(enter <= 0) & (leave >= 0) for enter, leave in spans], axis=0)
    origins, directions = origins[~inside], directions[~inside]
    assert len(origins) > 300
    t = np.array([entry(body, origins, directions) for body in bodies.bodies])
    t = t[:, near := (t.min(axis=0) < 1e5) | np.isinf(t.min(axis=0))]  # planes of the truth have ends
    origins, directions = origins[near], directions[near]
    hits = Surroundings(world).first_hits(origins, directions)
    met = np.isfinite(hits.distance_mm)
    assert met.sum() > 100
    assert np.array_equal(met, np.isfinite(t.min(axis=0)))
    assert hits.distance_mm[met] == pytest.approx(t.min(axis=0)[met], rel=1e-9)
    assert np.array_equal(hits.body[met], t.argmin(axis=0)[met])
    points = origins + np.where(met, hits.distance_mm, 0.0)[:, None] * directions
    normals = np.array([bodies.bodies[n].normal(points[[k]])[0] for k, n in enumerate(hits.body) if n >= 0])
    assert np.abs((hits.normal[met] * normals).sum(axis=1)) == pytest.approx(np.ones(met.sum()), abs=1e-9)
    assert not hits.normal[~met].any()


def test_clearance_of_the_obstacles() -> None:
    around = Surroundings(load_world(WORLDS[0]))
    vehicle = Vehicle()
    found = {
        heading: around.clearance(Pose(x_mm=0, y_mm=0, heading_deg=heading), vehicle)
        for heading in (0, 90, 180, 270)
    }
    names = [around.names[one.body] for one in found.values()]
    assert names == ["cube", "prism", "cylinder", "ramp"]
    # The prism's side lies on y = 6000 - 100 / cos(30 deg) + tan(60 deg) x; at -90 mm it is nearest.
    side = 6000 - 100 / cos(radians(60)) - tan(radians(60)) * 90
    low = vehicle.clearance_mm / tan(radians(30))
    expected = (5900.0, side, 5800.0, 5700.0 + low)
    assert [one.distance_mm for one in found.values()] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("aside_mm", "expected"), [(0.0, 5800.0), (190.0, 6000 - sqrt(200**2 - 100**2)), (290.5, 8000.0)]
)
def test_clearance_beside_a_cylinder(aside_mm: float, expected: float) -> None:
    around = Surroundings(load_world(WORLDS[0]))
    pose = Pose(x_mm=0.0, y_mm=aside_mm, heading_deg=180)
    assert around.clearance(pose, Vehicle()).distance_mm == pytest.approx(expected)


@pytest.mark.parametrize("seed", [1, 2])
def test_clearance_agrees_with_rays_over_the_front(seed: int) -> None:
    """The smallest of many rays from the front is an upper bound that is nearly reached."""
    rng = np.random.default_rng(seed)
    around, vehicle = Surroundings(ODD), Vehicle()
    x, y = np.meshgrid(np.linspace(-90, 90, 61), np.linspace(20, 120, 41))
    front = np.column_stack([x.ravel(), vehicle.sensor_height_mm - y.ravel(), np.zeros(x.size)])
    ahead = np.tile([0.0, 0.0, 1.0], (x.size, 1))
    for _ in range(20):
        # Outside of all bodies, towards them.
        angle = rng.uniform(0, 360)
        pose = Pose(x_mm=-1900 * cos(radians(angle)), y_mm=-1900 * sin(radians(angle)), heading_deg=angle)
        hits = around.first_hits(*world_rays(pose, vehicle, front, ahead))
        found = around.clearance(pose, vehicle).distance_mm
        assert found <= hits.distance_mm.min() + 0.1
        if np.isfinite(found) and found < 5000:
            assert found == pytest.approx(hits.distance_mm.min(), abs=12.0)


def test_what_is_low_or_high_is_no_obstacle() -> None:
    bodies = [
        {"kind": "box", "name": "sill", "at_mm": [500, 0], "size_mm": [50, 500, 15]},
        {"kind": "box", "name": "shelf", "at_mm": [700, 0], "size_mm": [50, 500, 20], "base_mm": 130},
        {"kind": "box", "name": "wall", "at_mm": [1000, 0], "size_mm": [50, 500, 400]},
    ]
    world = World.model_validate({"format": 1, "world": "w", "title": "t", "bodies": bodies})
    around = Surroundings(world)
    assert around.clearance(Pose(x_mm=0, y_mm=0), Vehicle()).distance_mm == pytest.approx(975.0)
    assert around.clearance(Pose(x_mm=0, y_mm=0), Vehicle(clearance_mm=10)).distance_mm == pytest.approx(
        475.0
    )
    assert around.clearance(Pose(x_mm=0, y_mm=0), Vehicle(height_mm=140)).distance_mm == pytest.approx(675.0)


def test_vehicle_frame() -> None:
    pose = Pose(x_mm=100, y_mm=200, heading_deg=90)
    assert vehicle_frame(pose, np.array([[90.0, 300.0, 5.0]])) == pytest.approx(
        np.array([[100.0, 10.0, 5.0]])
    )
