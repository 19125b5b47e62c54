"""Worlds of the virtual bench: spots where beams meet bodies, shadows, speckle and motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.ideal import CX, CY, F, ideal_rig, laser, moments, scene_of
from workbench.emulator.keyed import generator
from workbench.emulator.lens import Drift
from workbench.emulator.scene import BenchScene
from workbench.emulator.speckle import MAP_PX, SpeckleMap, speckle_field, subsamples
from workbench.emulator.spot import ImageFormat, SpotImage, streaked
from workbench.model.target import FlatTarget, Placement, WorldTarget
from workbench.model.world import Pose, Vehicle, World

WALL = {"kind": "plane", "name": "wall", "point_mm": [2000, 0, 0], "normal": [-1, 0, 0]}
FLOOR = {"kind": "plane", "name": "floor", "point_mm": [0, 0, 0], "normal": [0, 0, 1]}


def world_of(*bodies: dict[str, Any]) -> World:
    return World.model_validate({"format": 1, "world": "w", "title": "t", "bodies": list(bodies)})


def spots_in(
    scene: BenchScene,
    world: World,
    pose: Pose | None = None,
    speed_mm_s: float = 0.0,
    exposure_s: float = 0.0,
) -> list[SpotImage]:
    target = WorldTarget(world=world, pose=pose or Pose(x_mm=0, y_mm=0), speed_mm_s=speed_mm_s)
    scene.place(Placement(key="P", standoff_mm=1000.0, target=target))
    return scene.spots("L", exposure_s=exposure_s)


@pytest.mark.parametrize("offset_mm", [0.0, 25.0])
def test_a_wall_is_a_flat_target(tmp_path: Path, offset_mm: float) -> None:
    """The same light as on a flat target at the same depth, which is rendered without tables."""
    rig = ideal_rig(laser("L", 60.0), truth={"offset_mm": offset_mm}, lens={"blur_px": 0.7})
    (spot,) = spots_in(scene_of(rig, tmp_path), world_of(WALL, FLOOR))
    flat = scene_of(rig, tmp_path)
    flat.place(Placement(key="P", standoff_mm=2000.0, target=FlatTarget()))
    (expected,) = flat.spots("L")
    assert (spot.left, spot.top, spot.rate.shape) == (expected.left, expected.top, expected.rate.shape)
    assert spot.rate.sum() == pytest.approx(expected.rate.sum(), rel=1e-3)
    assert moments(spot)[0] == pytest.approx(moments(expected)[0], abs=1e-3)
    assert moments(spot)[0] == pytest.approx([CX + F * 60 / (2000 + offset_mm), CY], abs=2e-3)


@pytest.mark.parametrize(
    ("x", "y", "heading_deg", "seen"),
    [(-500.0, 130.0, 0.0, 1), (-500.0, 30.0, 0.0, 0), (30.0, -500.0, 90.0, 1), (150.0, -500.0, 90.0, 0)],
)
def test_pose_turns_and_moves_the_camera(
    tmp_path: Path, x: float, y: float, heading_deg: float, seen: int
) -> None:
    """A beam 60 mm to the right meets or passes a box from 0 to 200 mm, 500 mm ahead."""
    box = {"kind": "box", "name": "box", "at_mm": [100, 100], "size_mm": [200, 200, 300]}
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    found = spots_in(scene, world_of(box), Pose(x_mm=x, y_mm=y, heading_deg=heading_deg))
    assert len(found) == seen
    for spot in found:
        assert moments(spot)[0][0] == pytest.approx(CX + F * 60 / 500, abs=5e-3)


def test_a_pole_takes_its_part_of_the_beam_from_the_wall(tmp_path: Path) -> None:
    """Beam of 2 mm at 1 m on a pole that covers its right half: two spots, and the light of both."""
    beam = {"exit_diameter_mm": 2.0, "divergence_mrad": 0.0, "speckle_contrast": 0.0}
    scene = scene_of(ideal_rig(laser("L", 60.0), beam=beam), tmp_path)
    pole = {"kind": "box", "name": "pole", "at_mm": [1005, -70], "size_mm": [10, 20, 500]}
    (whole,) = spots_in(scene, world_of(WALL))
    near, far = spots_in(scene, world_of(pole, WALL))
    if near.left < far.left:
        near, far = far, near
    assert far.rate.sum() == pytest.approx(whole.rate.sum() / 2, rel=0.02)
    # From the nearer surface half the beam gives (2000 / 1000)^2 the light, but for cos of the line of sight.
    assert near.rate.sum() == pytest.approx(whole.rate.sum() / 2 * 4, rel=0.02)
    assert moments(far)[0][0] < CX + F * 60 / 2000  # its left part is left
    assert moments(near)[0][0] > CX + F * 60 / 1000


def test_a_body_before_the_camera_hides_the_spot(tmp_path: Path) -> None:
    """A post between the camera and the spot, beside the beam."""
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    post = {"kind": "pole", "name": "post", "from_mm": [500, -15, 0], "to_mm": [500, -15, 500],
            "diameter_mm": 20}  # fmt: skip
    assert len(spots_in(scene, world_of(WALL))) == 1
    assert spots_in(scene, world_of(WALL, post)) == []


def test_darker_bodies_return_less_light(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0), surface={"albedo": 0.8}), tmp_path)
    (light,), (dark,) = (spots_in(scene, world_of(wall)) for wall in (WALL, WALL | {"albedo": 0.08}))
    assert dark.rate.sum() == pytest.approx(light.rate.sum() / 10, rel=1e-5)


def test_speckle_follows_the_pose(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0), beam={"speckle_contrast": 1.0}), tmp_path)
    patterns = [spots_in(scene, world_of(WALL), Pose(x_mm=x, y_mm=0))[0].rate for x in (0, 0.001, 0)]
    assert np.array_equal(patterns[0], patterns[2])
    assert not np.allclose(patterns[0], patterns[1])


def test_a_map_has_the_contrast_of_single_patterns() -> None:
    """Speckle averaged over pixels: the mean of many small patterns against cuts of the map."""
    grain, n = 0.2, subsamples(0.2)
    single = [
        speckle_field((20 * n, 20 * n), 1 / n, grain, 1.0, generator(k)).reshape(20, n, 20, n).mean((1, 3))
        for k in range(40)
    ]
    made = SpeckleMap(grain, 1.0, generator(9))
    cuts = [made.cut((20, 20), generator(k)) for k in range(400)]
    assert made.cut((MAP_PX, MAP_PX), generator(0)).mean() == pytest.approx(1.0, abs=0.01)
    expected = np.std(single)
    # 16 000 nearly independent pixels: the relative error of a deviation is below 1 % for each.
    assert np.std(cuts) == pytest.approx(expected, rel=0.04)
    assert expected == pytest.approx(np.sqrt(np.pi / 4 * 4 / np.pi * grain**2 * 4 / np.pi), rel=0.2)


def test_motion_makes_a_streak(tmp_path: Path) -> None:
    """300 mm/s during 10 ms at 500 mm: the spot moves by f b dz / z^2, and keeps its centre and light."""
    scene = scene_of(ideal_rig(laser("L", 60.0), beam={"speckle_contrast": 0.0}), tmp_path)
    near = WALL | {"point_mm": [500, 0, 0]}
    (still,) = spots_in(scene, world_of(near), speed_mm_s=300.0)
    (streak,) = spots_in(scene, world_of(near), speed_mm_s=300.0, exposure_s=0.01)
    moved = F * 60 * 3 / 500**2
    centre, width = moments(still)
    blurred, wider = moments(streak)
    assert blurred == pytest.approx(centre, abs=0.01)
    assert streak.rate.sum() == pytest.approx(still.rate.sum(), rel=1e-3)
    # A uniform motion of length d adds d^2 / 12; interpolation adds at most 1/4 px^2 of variance.
    assert wider[0] - width[0] == pytest.approx(moved**2 / 12, abs=0.26)


def test_a_streak_stays_in_the_image() -> None:
    spot = SpotImage(0, 470, np.ones((10, 8), np.float32))
    moved = streaked(spot, (4.0, 3.0), ImageFormat(640, 480))
    assert moved.left == 0
    assert moved.top + moved.rate.shape[0] <= 480
    assert streaked(spot, (0.01, 0.0), ImageFormat(640, 480)) is spot


def test_tables_follow_the_drift_of_the_camera(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    target = WorldTarget(world=world_of(WALL), vehicle=Vehicle(), pose=Pose(x_mm=0, y_mm=0))
    scene.place(Placement(key="P", standoff_mm=1000.0, target=target))
    (before,), (after,) = scene.spots("L"), scene.spots("L", Drift(u_px=2.0))
    assert moments(after)[0][0] - moments(before)[0][0] == pytest.approx(2.0, abs=0.01)
