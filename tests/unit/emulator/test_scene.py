"""Targets stand where they are put, and show the beams that meet them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.ideal import CX, CY, F, exact, ideal_rig, laser, moments, painted, scene_of
from tests.support.rigs import opencv_pixels
from tests.support.virtual_bench import read_truth
from workbench.emulator.lens import Drift
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement


def test_speckle_stands_still_until_the_target_moves(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(beam={"speckle_contrast": 1.0}), tmp_path)
    patterns = []
    for key in ("A", "B", "A"):
        scene.place(Placement(key=key, standoff_mm=500.0))
        patterns.append(scene.spots("L1")[0].rate)
    assert np.array_equal(patterns[0], patterns[2])
    assert not np.array_equal(patterns[0], patterns[1])


def test_a_move_along_the_face_changes_speckle_alone(tmp_path: Path) -> None:
    for contrast in (0.0, 1.0):
        scene = scene_of(ideal_rig(beam={"speckle_contrast": contrast}), tmp_path)
        patterns = []
        for shift_mm in (0.0, 2.0, 4.0, 2.0):
            target = FlatTarget(shift_mm=shift_mm)
            scene.place(Placement(key="A", standoff_mm=500.0, target=target))
            patterns.append(scene.spots("L1")[0].rate)
        assert np.array_equal(patterns[1], patterns[3])
        for changed in (patterns[0], patterns[2]):
            assert np.array_equal(patterns[1], changed) == (contrast == 0)


def test_nothing_is_seen_of_what_is_not_there(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    cases: list[tuple[float, Any]] = [
        (500.0, NoTarget()),
        (60.0, FlatTarget()),  # the spot leaves the field of view
        (500.0, FlatTarget(width_mm=80.0)),
        (500.0, FlatTarget(height_mm=20.0, width_mm=40.0, shift_mm=-60.0)),
        (500.0, CylinderTarget(diameter_mm=100.0)),
    ]
    assert scene.spots("L") == []
    for standoff, target in cases:
        scene.place(Placement(key="P", standoff_mm=standoff, target=target))
        assert scene.spots("L") == []


def test_small_target_shows_the_beams_that_meet_it(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("A", 60.0), laser("B", 30.0)), tmp_path)
    scene.place(Placement(key="P", standoff_mm=500.0, target=FlatTarget(width_mm=40.0, shift_mm=60.0)))
    assert [len(scene.spots(name)) for name in ("A", "B")] == [1, 0]


@pytest.mark.parametrize("yaw", [0.0, 5.0, -8.0])
def test_mirror_shows_the_wall_where_the_light_comes_from(tmp_path: Path, yaw: float) -> None:
    scene = scene_of(
        ideal_rig(laser("L", 60.0), surface={"wall_behind_mm": 1000.0}, lens={"blur_px": 0.7}), tmp_path
    )
    scene.place(Placement(key="P", standoff_mm=600.0, target=FlatTarget(finish="mirror", yaw_deg=yaw)))
    face, ghost = (moments(spot)[0][0] for spot in scene.spots("L"))
    tangent = np.tan(np.radians(yaw))
    hit_z = 600 + 60 * tangent
    assert face == pytest.approx(CX + F * 60 / hit_z, abs=0.01)
    # Law of reflection: the beam (0, 1) leaves as (sin 2 yaw, -cos 2 yaw) and meets the wall z = -1000 there;
    # the camera sees that point's mirror image, at its perpendicular distance behind the mirror.
    turn = 2 * np.radians(yaw)
    path = (hit_z + 1000) / np.cos(turn)
    wall = np.array([60 + path * np.sin(turn), -1000.0])
    normal = np.array([-np.sin(turn / 2), np.cos(turn / 2)])
    image = wall - 2 * ((wall - [0, 600.0]) @ normal) * normal
    assert ghost == pytest.approx(CX + F * image[0] / image[1], abs=0.01)


def test_a_mirror_turned_far_shows_no_second_spot(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    scene.place(Placement(key="P", standoff_mm=600.0, target=FlatTarget(finish="mirror", yaw_deg=50.0)))
    assert len(scene.spots("L")) == 1


def test_the_standoff_is_by_the_ruler(tmp_path: Path) -> None:
    truth = {"offset_mm": 12.0, "ruler_scale": 0.001, "placements": {"P": {"error_mm": 0.4}}}
    centre, _ = moments(painted(ideal_rig(truth=truth), tmp_path, 500.0))
    assert centre[0] == pytest.approx(CX + F * 60 / (500.5 + 0.4 + 12), abs=3e-3)


def test_tilt_of_the_placement_adds_to_the_targets(tmp_path: Path) -> None:
    rig = ideal_rig(truth={"placements": {"P": {"yaw_deg": 10.0, "pitch_deg": 0.0}}})
    centre, _ = moments(painted(rig, tmp_path, 500.0, FlatTarget(yaw_deg=20.0)))
    assert centre[0] == pytest.approx(CX + F * 60 / (500 + 60 * np.tan(np.radians(30))), abs=0.01)


@pytest.mark.parametrize(("yaw", "pitch"), [(0.0, 0.0), (4.0, 0.0), (0.0, -6.0), (-12.0, 9.0)])
def test_a_common_tilt_adds_to_every_placement_s_own(tmp_path: Path, yaw: float, pitch: float) -> None:
    """Where OpenCV projects the point in which linear algebra has the ray meet the plane."""
    own = {"A": {"yaw_deg": 1.5, "pitch_deg": -2.0}, "B": {"yaw_deg": -3.0, "pitch_deg": 0.5}}
    truth = {"target_yaw_deg": yaw, "target_pitch_deg": pitch, "placements": own}
    rig = ideal_rig(laser("L", 60.0, 40.0, 0.01, -0.02), camera={"k1": exact(-0.2)}, truth=truth)
    scene = scene_of(rig, tmp_path)
    for key, standoff in (("A", 300.0), ("B", 700.0)):
        scene.place(Placement(key=key, standoff_mm=standoff))
        turn = np.radians([yaw + own[key]["yaw_deg"], pitch + own[key]["pitch_deg"]])
        system = np.array([[1, 0, -0.01], [0, 1, 0.02], [*-np.tan(turn), 1.0]])
        point = np.linalg.solve(system, [60.0, 40.0, standoff])
        centre, _ = moments(scene.spots("L")[0])
        assert centre == pytest.approx(projected(point), abs=0.01)


def test_the_truth_of_a_placement_is_its_own_tilt(tmp_path: Path) -> None:
    truth = {"target_yaw_deg": 4.0, "placements": {"P": {"yaw_deg": 1.5}}}
    scene_of(ideal_rig(truth=truth), tmp_path).place(Placement(key="P", standoff_mm=500.0))
    written = read_truth(tmp_path / "truth.yaml")
    assert (written["target_yaw_deg"], written["placements"]["P"]["yaw_deg"]) == (4.0, 1.5)


def test_a_drift_moves_the_picture_as_a_moved_image_centre_does(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0, 40.0), camera={"k1": exact(-0.2)}), tmp_path)
    scene.place(Placement(key="P", standoff_mm=500.0))
    for u_px, v_px in ((0.0, 0.0), (3.25, -1.5), (-0.4, 0.0)):
        centre, _ = moments(scene.spots("L", Drift(u_px=u_px, v_px=v_px))[0])
        expected = projected(np.array([60.0, 40.0, 500.0]), CX + u_px, CY + v_px)
        assert centre == pytest.approx(expected, abs=0.01)


def projected(point_mm: FloatArray, cx: float = CX, cy: float = CY) -> FloatArray:
    """(2,) where OpenCV has a point (3,) in the picture of a lens with k1 = -0.2."""
    values = [F, cx, cy, -0.2, 0.0, 0.0, 0.0, 0.0]
    return np.asarray(opencv_pixels("plumb_bob", values, point_mm[None])[0])


def test_a_plane_on_edge_is_refused(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(), tmp_path)
    with pytest.raises(BadInputError, match="90 deg"):
        scene.place(Placement(key="P", standoff_mm=500.0, target=FlatTarget(yaw_deg=90.0)))


def test_the_principal_point_and_f_are_the_truths(tmp_path: Path) -> None:
    rig = ideal_rig(camera={"f_px": exact(600.0)}, truth={"cx_px": 350.0, "cy_px": 220.0})
    centre, _ = moments(painted(rig, tmp_path, 1000.0))
    assert centre == pytest.approx([350 + 36, 220], abs=2e-3)


def test_a_blocked_beam_has_no_spot(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L1", -60.0), laser("L2", 60.0)), tmp_path)
    scene.place(Placement(key="A", standoff_mm=500.0, blocked=("L2",)))
    assert len(scene.spots("L1")) == 1
    assert scene.spots("L2") == []
    scene.place(Placement(key="A", standoff_mm=500.0))
    assert len(scene.spots("L2")) == 1
