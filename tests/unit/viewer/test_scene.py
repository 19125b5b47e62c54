"""The bench in 3D: rays, targets, and points on them, against geometry by hand."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path

import numpy as np
import pytest

from tests.support.viewer_stream import COLORS, HERE, a_range, a_spot, logged, packed
from tests.viewer.readback import Contents
from tests.viewer.session import a_rig
from workbench.model.target import (
    BoardTarget,
    CylinderTarget,
    FlatTarget,
    NoTarget,
    Placement,
    PolynomialTarget,
    TargetShape,
)
from workbench.viewer.geometry import Geometry
from workbench.viewer.scene import (
    BEYOND,
    DRAWN_DEPTH_MM,
    log_camera,
    log_placement,
    log_ranged,
    log_spots_on_target,
)
from workbench.viewer.stream import Moment, Stream

RIG = a_rig()
GEOMETRY = Geometry(
    "plumb_bob",
    Geometry.of_rig(RIG).lens,
    12.0,
    {name: (x, y, 0.01, -0.02) for name, (x, y, _, _) in Geometry.of_rig(RIG).rays.items()},
)
POINTS, STRIPS, LABELS = "Points3D:positions", "LineStrips3D:strips", "Points3D:labels"
STANDOFFS = (140.0, 500.0, 3800.0)
FLAT = Placement(key="p", standoff_mm=500.0)


def placed(folder: Path, target: TargetShape, standoff_mm: float = 500.0) -> Contents:
    placement = Placement(key="p", standoff_mm=standoff_mm, target=target)
    return logged(folder, lambda stream: log_placement(stream, placement, GEOMETRY, COLORS))


def outline(folder: Path, target: TargetShape, standoff_mm: float = 500.0) -> np.ndarray:
    """(n, 3) points of all lines of a target, with their true depths."""
    ((_, strips),) = placed(folder, target, standoff_mm).values("/bench/target", STRIPS)
    points = np.array([point for strip in strips for point in strip]).reshape(-1, 3)
    return true_depths(points, standoff_mm)


def true_depths(points: np.ndarray, standoff_mm: float) -> np.ndarray:
    return points * [1.0, 1.0, (standoff_mm + 12.0) / DRAWN_DEPTH_MM]


@pytest.mark.parametrize("standoff_mm", STANDOFFS)
def test_the_target_is_drawn_at_the_same_depth_at_every_standoff(tmp_path: Path, standoff_mm: float) -> None:
    ((_, strips),) = placed(tmp_path, FlatTarget(), standoff_mm).values("/bench/target", STRIPS)
    z = np.array([point for strip in strips for point in strip])[:, 2]
    np.testing.assert_allclose(z, DRAWN_DEPTH_MM, rtol=1e-6)


@pytest.mark.parametrize("standoff_mm", STANDOFFS)
def test_rays_go_from_the_plane_of_the_pinhole_to_a_little_beyond_the_target(
    tmp_path: Path, standoff_mm: float
) -> None:
    contents = placed(tmp_path, FlatTarget(), standoff_mm)
    for laser in RIG.laser_ids:
        x, y, tx, ty = GEOMETRY.rays[laser]
        ((_, (ray,)),) = contents.values(f"/bench/rays/{laser}", STRIPS)
        far_mm = BEYOND * (standoff_mm + 12.0)
        end = [x + tx * far_mm, y + ty * far_mm, BEYOND * DRAWN_DEPTH_MM]
        np.testing.assert_allclose(ray, [[x, y, 0.0], end], rtol=1e-6, atol=1e-4)
        ((_, colors),) = contents.values(f"/bench/rays/{laser}", "LineStrips3D:colors")
        assert colors == [packed(COLORS[laser])]
        assert contents.values(f"/bench/rays/{laser}/label", LABELS) == [(1, [laser])]


def test_labels_of_neighbouring_lasers_have_different_heights(tmp_path: Path) -> None:
    contents = placed(tmp_path, FlatTarget())
    heights = [
        contents.values(f"/bench/rays/{laser}/label", POINTS)[0][1][0][1]
        - contents.values(f"/bench/rays/{laser}", STRIPS)[0][1][0][0][1]
        for laser in RIG.laser_ids
    ]
    assert all(height < 0 for height in heights), "above the exits"
    assert abs(np.diff(heights)).min() > 10.0


def test_the_camera_has_the_picture_s_size_and_rerun_s_pixel_corner(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_camera(stream, RIG.camera, GEOMETRY))
    ((_, matrix),) = contents.values("/bench/camera", "Pinhole:image_from_camera")
    expected = GEOMETRY.camera_matrix + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    np.testing.assert_allclose(np.reshape(matrix, (3, 3)).T, expected, rtol=1e-6)
    ((_, size),) = contents.values("/bench/camera", "Pinhole:resolution")
    assert size == [[640.0, 480.0]]


def test_x_points_right_and_y_down_for_all_time(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_camera(stream, RIG.camera, GEOMETRY))
    right, down, forward = 3, 2, 5
    assert contents.static("/bench", "ViewCoordinates:xyz") == [[[right, down, forward]]]


@pytest.mark.parametrize("kind", [FlatTarget, BoardTarget])
def test_a_flat_lies_on_its_tilted_plane_behind_the_reference_plane(
    tmp_path: Path, kind: type[FlatTarget] | type[BoardTarget]
) -> None:
    x, y, z = outline(tmp_path, kind(yaw_deg=10.0, pitch_deg=-5.0)).T
    np.testing.assert_allclose(z, 512.0 + tan(radians(10)) * x + tan(radians(-5)) * y, atol=1e-3)
    assert np.ptp(x) == pytest.approx(np.ptp(y))


def test_a_cylinder_lies_on_its_circle_with_its_nearest_point_at_the_standoff(tmp_path: Path) -> None:
    x, _, z = outline(tmp_path, CylinderTarget(diameter_mm=120.0, shift_mm=20.0)).T
    np.testing.assert_allclose(np.hypot(x - 20.0, z - 572.0), 60.0, atol=1e-3)
    assert z.min() == pytest.approx(512.0)


def test_a_polynomial_lies_on_its_curve(tmp_path: Path) -> None:
    x, _, z = outline(tmp_path, PolynomialTarget(coefficients=(0.1, 0.001), shift_mm=30.0)).T
    np.testing.assert_allclose(z, 512.0 + 0.1 * (x - 30) + 0.001 * (x - 30) ** 2, atol=1e-3)


def test_no_target_has_neither_outline_nor_label(tmp_path: Path) -> None:
    contents = placed(tmp_path, NoTarget())
    assert contents.values("/bench/target", STRIPS) == [(1, [])]
    assert contents.values("/bench/target/label", POINTS) == [(1, [])]
    assert contents.values("/bench/rays/L1", STRIPS) != []


@pytest.mark.parametrize(
    ("target", "parts"),
    [
        (FlatTarget(), ["flat"]),
        (FlatTarget(yaw_deg=30.0), ["incline", "30 deg"]),
        (FlatTarget(pitch_deg=-8.0), ["incline", "-8 deg"]),
        (BoardTarget(), ["board"]),
        (CylinderTarget(diameter_mm=178.0), ["cylinder", "178 mm"]),
        (PolynomialTarget(coefficients=(0.1,)), ["polynomial"]),
    ],
)
@pytest.mark.parametrize("standoff_mm", STANDOFFS)
def test_the_label_has_the_kind_of_target_and_the_standoff(
    tmp_path: Path, target: TargetShape, parts: list[str], standoff_mm: float
) -> None:
    ((_, (text,)),) = placed(tmp_path, target, standoff_mm).values("/bench/target/label", LABELS)
    for part in [*parts, f"{standoff_mm:g} mm"]:
        assert part in text


def test_a_flat_has_a_translucent_face_that_the_next_shape_removes(tmp_path: Path) -> None:
    round_one = Placement(key="q", standoff_mm=500.0, target=CylinderTarget(diameter_mm=90.0))

    def log(stream: Stream) -> None:
        log_placement(stream, FLAT, GEOMETRY, COLORS)
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        log_placement(stream, round_one, GEOMETRY, COLORS)

    contents = logged(tmp_path, log)
    face = "/bench/target/face"
    ((_, (factor,)),) = contents.values(face, "Mesh3D:albedo_factor")
    assert 0 < factor & 0xFF < 128
    assert contents.shown(face, "Mesh3D:vertex_positions", "capture", 1) is not None
    assert contents.shown(face, "Mesh3D:vertex_positions", "capture", 2) is None


def test_a_new_placement_removes_the_points_of_the_one_before(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        log_spots_on_target(stream, (a_spot("L1", 250.0),), FLAT, GEOMETRY, COLORS)
        log_ranged(stream, (a_range("L1", 500.0),), FLAT, GEOMETRY, COLORS)
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        log_placement(stream, Placement(key="q", standoff_mm=900.0), GEOMETRY, COLORS)

    contents = logged(tmp_path, log)
    for entity, component in (
        ("/bench/ranged", POINTS),
        ("/bench/ranged/intervals", STRIPS),
        ("/bench/spots/L1", POINTS),
    ):
        assert contents.shown(entity, component, "capture", 1) is not None
        assert contents.shown(entity, component, "capture", 2) is None


@pytest.mark.parametrize("standoff_mm", STANDOFFS)
@pytest.mark.parametrize("target", [FlatTarget(), FlatTarget(yaw_deg=25.0, pitch_deg=-10.0), BoardTarget()])
def test_rays_meet_the_spots_of_data_without_noise(
    tmp_path: Path, standoff_mm: float, target: FlatTarget | BoardTarget
) -> None:
    placement = Placement(key="p", standoff_mm=standoff_mm, target=target)
    spots = [a_spot(laser, *GEOMETRY.spot_on(laser, target, standoff_mm).tolist()) for laser in RIG.laser_ids]

    def log(stream: Stream) -> None:
        log_placement(stream, placement, GEOMETRY, COLORS)
        log_spots_on_target(stream, spots, placement, GEOMETRY, COLORS)

    contents = logged(tmp_path, log)
    for laser in RIG.laser_ids:
        ((_, (ray,)),) = contents.values(f"/bench/rays/{laser}", STRIPS)
        ((_, (dot,)),) = contents.values(f"/bench/spots/{laser}", POINTS)
        start, end, point = np.array([*ray, dot])
        along = (end - start) / np.linalg.norm(end - start)
        off = (point - start) - ((point - start) @ along) * along
        # Rerun's points have 32 bits.
        assert np.linalg.norm(off) < 1e-3


def test_spots_lie_on_the_target_where_the_camera_sees_them(tmp_path: Path) -> None:
    placement = Placement(key="p", standoff_mm=500.0, target=FlatTarget(yaw_deg=20.0))
    spots = (a_spot("L1", 250.0, 200.0), a_spot(None, 400.0, 260.0), a_spot(None, 300.0, 240.0))
    contents = logged(
        tmp_path, lambda stream: log_spots_on_target(stream, spots, placement, GEOMETRY, COLORS)
    )
    ((_, of_l1),) = contents.values("/bench/spots/L1", POINTS)
    ((_, others),) = contents.values("/bench/spots/unassigned", POINTS)
    for (x, y, z), spot in zip(true_depths(np.array([*of_l1, *others]), 500.0), spots, strict=True):
        assert z == pytest.approx(512.0 + tan(radians(20)) * x, abs=1e-3)
        seen_at = (319.5 + 533.3 * x / z, 239.5 + 533.3 * y / z)
        assert seen_at == pytest.approx((spot.u_px, spot.v_px), abs=1e-3)


@pytest.mark.parametrize("target", [CylinderTarget(diameter_mm=100.0), NoTarget()])
def test_spots_on_no_flat_are_not_drawn(tmp_path: Path, target: TargetShape) -> None:
    placement = Placement(key="p", standoff_mm=500.0, target=target)
    contents = logged(
        tmp_path,
        lambda stream: log_spots_on_target(stream, (a_spot("L1", 250.0),), placement, GEOMETRY, COLORS),
    )
    assert not any(entity.startswith("/bench/spots") for entity in contents.entities)


@pytest.mark.parametrize("standoff_mm", STANDOFFS)
def test_ranged_points_lie_on_their_rays_at_range_and_offset(tmp_path: Path, standoff_mm: float) -> None:
    placement = Placement(key="p", standoff_mm=standoff_mm)
    ranged = (a_range("L4", 700.0), a_range("of another rig", 700.0), a_range("L1", 300.0))
    contents = logged(tmp_path, lambda stream: log_ranged(stream, ranged, placement, GEOMETRY, COLORS))
    ((_, points),) = contents.values("/bench/ranged", POINTS)
    expected = [GEOMETRY.ray_at("L4", 712.0), GEOMETRY.ray_at("L1", 312.0)]
    np.testing.assert_allclose(true_depths(np.array(points), standoff_mm), expected, rtol=1e-6)


def test_intervals_lie_along_the_rays(tmp_path: Path) -> None:
    """The stated ends, or two standard deviations where none is known."""
    stated = a_range("L4", 700.0, 5.0).model_copy(update={"low_mm": 691.0, "high_mm": 712.0})
    ranged = (stated, a_range("L1", 300.0, 4.0))
    contents = logged(tmp_path, lambda stream: log_ranged(stream, ranged, FLAT, GEOMETRY, COLORS))
    ((_, bars),) = contents.values("/bench/ranged/intervals", STRIPS)
    expected = [
        [GEOMETRY.ray_at("L4", end + 12.0) for end in (691.0, 712.0)],
        [GEOMETRY.ray_at("L1", end + 12.0) for end in (292.0, 308.0)],
    ]
    np.testing.assert_allclose(true_depths(np.array(bars), 500.0), expected, rtol=1e-6)
    ((_, colors),) = contents.values("/bench/ranged/intervals", "LineStrips3D:colors")
    assert colors == [packed(COLORS["L4"]), packed(COLORS["L1"])]


def test_a_reading_without_ranges_removes_the_points_of_the_last_one(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        log_ranged(stream, (a_range("L1", 500.0),), FLAT, GEOMETRY, COLORS)
        log_ranged(stream, (), FLAT, GEOMETRY, COLORS)

    contents = logged(tmp_path, log)
    assert contents.values("/bench/ranged", POINTS)[-1] == (1, [])
    assert contents.values("/bench/ranged/intervals", STRIPS)[-1] == (1, [])


@pytest.mark.parametrize("offset_mm", [-500.0, -800.0])
def test_a_target_in_or_behind_the_pinhole_by_a_wrong_offset_is_no_failure(
    tmp_path: Path, offset_mm: float
) -> None:
    wrong = Geometry("plumb_bob", GEOMETRY.lens, offset_mm, GEOMETRY.rays)
    contents = logged(tmp_path, lambda stream: log_placement(stream, FLAT, wrong, COLORS))
    ((_, strips),) = contents.values("/bench/target", STRIPS)
    assert np.isfinite([point for strip in strips for point in strip]).all()
