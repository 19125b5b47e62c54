"""The bench in 3D: rays, targets, and points on them, against geometry by hand."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path

import numpy as np
import pytest

from tests.support.viewer_stream import COLORS, HERE, a_range, a_spot, logged, packed
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
    RAY_LENGTH_MM,
    log_ranged,
    log_sensor,
    log_spots_on_target,
    log_styles,
    log_target,
)
from workbench.viewer.stream import Moment, Stream

RIG = a_rig()
GEOMETRY = Geometry(
    "plumb_bob",
    Geometry.of_rig(RIG).lens,
    12.0,
    {name: (x, y, 0.01, -0.02) for name, (x, y, _, _) in Geometry.of_rig(RIG).rays.items()},
)
POINTS, STRIPS = "Points3D:positions", "LineStrips3D:strips"


def outline(folder: Path, target: TargetShape) -> np.ndarray:
    """(n, 3) points of all lines of a target at 500 mm."""
    placement = Placement(key="p", standoff_mm=500.0, target=target)
    contents = logged(folder, lambda stream: log_target(stream, placement, GEOMETRY))
    ((_, strips),) = contents.values("/bench/target", STRIPS)
    return np.array([point for strip in strips for point in strip]).reshape(-1, 3)


def test_rays_are_drawn_from_the_plane_of_the_pinhole_outwards(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_sensor(stream, RIG.camera, GEOMETRY, COLORS))
    for laser in RIG.laser_ids:
        x, y, tx, ty = GEOMETRY.rays[laser]
        ((_, strips),) = contents.values(f"/bench/rays/{laser}", STRIPS)
        end = [x + tx * RAY_LENGTH_MM, y + ty * RAY_LENGTH_MM, RAY_LENGTH_MM]
        np.testing.assert_allclose(strips[0], [[x, y, 0.0], end], rtol=1e-6, atol=1e-4)
        ((_, colors),) = contents.values(f"/bench/rays/{laser}", "LineStrips3D:colors")
        assert colors == [packed(COLORS[laser])]


def test_the_camera_has_the_picture_s_size_and_rerun_s_pixel_corner(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_sensor(stream, RIG.camera, GEOMETRY, COLORS))
    ((_, matrix),) = contents.values("/bench/camera", "Pinhole:image_from_camera")
    expected = GEOMETRY.camera_matrix + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    np.testing.assert_allclose(np.reshape(matrix, (3, 3)).T, expected, rtol=1e-6)
    ((_, size),) = contents.values("/bench/camera", "Pinhole:resolution")
    assert size == [[640.0, 480.0]]


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
    assert outline(tmp_path, NoTarget()).size == 0
    contents = logged(
        tmp_path,
        lambda stream: log_target(stream, Placement(key="p", standoff_mm=500.0, target=NoTarget()), GEOMETRY),
    )
    assert contents.values("/bench/target/label", POINTS) == [(1, [])]
    assert contents.values("/target/standoff_mm", "Scalars:scalars") == [(1, [500.0])]


def test_a_new_placement_takes_the_points_of_the_one_before_away(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        log_ranged(stream, (a_range("L1", 500.0),), GEOMETRY, COLORS)
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        log_target(stream, Placement(key="q", standoff_mm=900.0), GEOMETRY)

    contents = logged(tmp_path, log)
    assert [number for number, _ in contents.values("/bench/ranged", "Clear:is_recursive")] == [2]
    assert [number for number, _ in contents.values("/bench/spots", "Clear:is_recursive")] == [2]


def test_ranged_points_lie_on_their_rays_at_range_and_offset(tmp_path: Path) -> None:
    ranged = (a_range("L4", 700.0), a_range("of another rig", 700.0), a_range("L1", 300.0))
    contents = logged(tmp_path, lambda stream: log_ranged(stream, ranged, GEOMETRY, COLORS))
    ((_, points),) = contents.values("/bench/ranged", POINTS)
    expected = [GEOMETRY.ray_at("L4", 712.0), GEOMETRY.ray_at("L1", 312.0)]
    np.testing.assert_allclose(points, expected, rtol=1e-6)


def test_spots_lie_on_the_target_where_the_camera_sees_them(tmp_path: Path) -> None:
    target = FlatTarget(yaw_deg=20.0)
    placement = Placement(key="p", standoff_mm=500.0, target=target)
    spots = (a_spot("L1", 250.0, 200.0), a_spot(None, 400.0, 260.0), a_spot(None, 300.0, 240.0))
    contents = logged(
        tmp_path, lambda stream: log_spots_on_target(stream, spots, placement, GEOMETRY, COLORS)
    )
    ((_, of_l1),) = contents.values("/bench/spots/L1", POINTS)
    ((_, others),) = contents.values("/bench/spots/unassigned", POINTS)
    for (x, y, z), spot in zip([*of_l1, *others], spots, strict=True):
        assert z == pytest.approx(512.0 + tan(radians(20)) * x, abs=1e-3)
        seen_at = (319.5 + 533.3 * x / z, 239.5 + 533.3 * y / z)
        assert seen_at == pytest.approx((spot.u_px, spot.v_px), abs=1e-3)


@pytest.mark.parametrize("target", [CylinderTarget(diameter_mm=100.0), NoTarget()])
def test_spots_on_no_flat_have_no_place_of_their_own(tmp_path: Path, target: TargetShape) -> None:
    placement = Placement(key="p", standoff_mm=500.0, target=target)
    contents = logged(
        tmp_path,
        lambda stream: log_spots_on_target(stream, (a_spot("L1", 250.0),), placement, GEOMETRY, COLORS),
    )
    assert not any(entity.startswith("/bench/spots") for entity in contents.entities)


def test_x_points_right_and_y_down_for_all_time(tmp_path: Path) -> None:
    (row,) = logged(tmp_path, log_styles).everything()["/bench"]
    assert "capture" not in row
    right, down, forward = 3, 2, 5
    assert str([right, down, forward]) in row
