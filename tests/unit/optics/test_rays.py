"""Laser rays: against linear equations and OpenCV's lens."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import opencv_pixels
from workbench.optics.plumb_bob import PLUMB_BOB
from workbench.optics.rays import Plane, Ray, depth_on_plane, spot_at_inverse_depth, spot_on_plane

LENS = np.array([541.3, 358.7, 235.0, 0.11, -0.07, 0.002, -0.003, 0.01])
RAY = Ray(-60.1, 0.3, 0.004, -0.002)


def test_a_ray_meets_the_plane_where_the_equations_say() -> None:
    plane = Plane(700.0, 0.3, -0.1)
    z = float(depth_on_plane(RAY, plane))
    # The same as three linear equations: two of the ray, one of the plane.
    x, y, tx, ty = np.array(RAY, float)
    system = np.array([[1.0, 0.0, -tx], [0.0, 1.0, -ty], [-0.3, 0.1, 1.0]])
    point = np.linalg.solve(system, np.array([x, y, 700.0]))
    assert z == pytest.approx(point[2], rel=1e-13)
    pixels = np.array(spot_on_plane(PLUMB_BOB, LENS, RAY, plane))
    np.testing.assert_allclose(pixels, opencv_pixels("plumb_bob", LENS.tolist(), point[None])[0], atol=1e-9)


def test_the_spot_at_infinity_is_where_far_spots_go() -> None:
    infinity = np.array(spot_at_inverse_depth(PLUMB_BOB, LENS, RAY, 0.0))
    far = np.array(spot_at_inverse_depth(PLUMB_BOB, LENS, RAY, 1e-9))
    np.testing.assert_allclose(infinity, far, atol=1e-3)
