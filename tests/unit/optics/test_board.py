"""Points of a printed board: against axes that numpy makes, and on the plane."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.optics.board import Pose, point_on_board
from workbench.optics.rays import Plane

PLANES = [(500.0, 0.0, 0.0), (700.0, 0.3, -0.1), (300.0, -0.8, 0.5)]
"""z0 in mm, slopes along x and y."""
POINTS = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 60.0], [-80.0, -35.0], [42.0, -7.0]])


def points(pose: Pose, into_mm: float = 0.0) -> np.ndarray:
    return np.stack(point_on_board(pose, POINTS[:, 0], POINTS[:, 1], into_mm), axis=1)


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("roll_rad", [0.0, 0.4, np.pi / 2, -2.0])
def test_points_are_those_of_orthonormal_axes(plane: tuple[float, float, float], roll_rad: float) -> None:
    z0, slope_x, slope_y = plane
    found = points(Pose(Plane(*plane), 12.0, -7.0, roll_rad), 0.3)
    normal = np.array([-slope_x, -slope_y, 1.0])
    normal /= np.linalg.norm(normal)
    right = np.array([1.0, 0.0, slope_x])
    right /= np.linalg.norm(right)
    below = np.cross(normal, right)
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    across, down = c * right + s * below, -s * right + c * below
    middle = np.array([12.0, -7.0, z0 + slope_x * 12.0 - slope_y * 7.0])
    expected = middle + POINTS[:, :1] * across + POINTS[:, 1:] * down + 0.3 * normal
    np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("plane", PLANES)
def test_points_lie_on_the_plane_and_keep_their_distances(plane: tuple[float, float, float]) -> None:
    z0, slope_x, slope_y = plane
    found = points(Pose(Plane(*plane), 12.0, -7.0, 0.7))
    on_plane = z0 + slope_x * found[:, 0] + slope_y * found[:, 1]
    np.testing.assert_allclose(found[:, 2], on_plane, rtol=1e-12)
    apart = np.linalg.norm(found[:, None] - found, axis=2)
    np.testing.assert_allclose(apart, np.linalg.norm(POINTS[:, None] - POINTS, axis=2), atol=1e-10)


def test_a_board_across_the_axis_has_the_axes_of_the_camera() -> None:
    found = points(Pose(Plane(500.0), 0.0, 0.0, 0.0))
    np.testing.assert_allclose(found[:, :2], POINTS, atol=1e-12)
    np.testing.assert_allclose(found[:, 2], 500.0)
