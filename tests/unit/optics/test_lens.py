"""The optics against OpenCV's lens, against brute-force geometry and against finite differences."""

from __future__ import annotations

import cv2
import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.optics.lens import Lens, distort, project, radial_slope
from workbench.optics.rays import Plane, Ray, depth_on_plane, spot_at_inverse_depth, spot_on_plane
from workbench.optics.triangulate import MeasuredSpot, estimate_depth

LENS = Lens(541.3, 358.7, 235.0, 0.11, -0.07, 0.002, -0.003, 0.01)
RAY = Ray(-60.1, 0.3, 0.004, -0.002)


def opencv_pixels(lens: Lens, points_mm: np.ndarray) -> np.ndarray:
    camera = np.array([[lens.f_px, 0, lens.cx_px], [0, lens.f_px, lens.cy_px], [0, 0, 1]], float)
    coefficients = np.array(lens[3:], float)
    pixels, _ = cv2.projectPoints(points_mm, np.zeros(3), np.zeros(3), camera, coefficients)
    return pixels.reshape(-1, 2)


def test_jax_computes_with_64_bits() -> None:
    assert distort(LENS, 0.1, 0.2)[0].dtype == np.float64


def test_projection_is_opencv_s() -> None:
    points = np.random.default_rng(1).uniform([-400, -300, 800], [400, 300, 2000], (200, 3))
    ours = np.stack(project(LENS, points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]), axis=1)
    np.testing.assert_allclose(ours, opencv_pixels(LENS, points), rtol=0, atol=1e-9)


def test_an_undistorted_lens_is_a_pinhole() -> None:
    u, v = project(Lens(500.0, 320.0, 240.0), 0.2, -0.1)
    assert (float(u), float(v)) == pytest.approx((420.0, 190.0), abs=1e-12)


def test_radial_slope_is_the_derivative_of_the_radius() -> None:
    lens = Lens(1.0, 0.0, 0.0, -0.4, 0.05, 0.0, 0.0, 0.01)
    radius, step = np.linspace(0.0, 1.2, 13), 1e-6
    numeric = (distort(lens, radius + step, 0.0)[0] - distort(lens, radius - step, 0.0)[0]) / (2 * step)
    np.testing.assert_allclose(radial_slope(lens, radius, np.zeros(13)), numeric, atol=1e-8)
    assert radial_slope(lens, 1.2, 0.0) < 0  # this lens folds over


def test_a_ray_meets_the_plane_where_the_equations_say() -> None:
    plane = Plane(700.0, 0.3, -0.1)
    z = float(depth_on_plane(RAY, plane))
    # The same as three linear equations: two of the ray, one of the plane.
    x, y, tx, ty = np.array(RAY, float)
    system = np.array([[1.0, 0.0, -tx], [0.0, 1.0, -ty], [-0.3, 0.1, 1.0]])
    point = np.linalg.solve(system, np.array([x, y, 700.0]))
    assert z == pytest.approx(point[2], rel=1e-13)
    pixels = np.array(spot_on_plane(LENS, RAY, plane))
    np.testing.assert_allclose(pixels, opencv_pixels(LENS, point[None])[0], atol=1e-9)


def test_the_spot_at_infinity_is_where_far_spots_go() -> None:
    infinity = np.array(spot_at_inverse_depth(LENS, RAY, 0.0))
    far = np.array(spot_at_inverse_depth(LENS, RAY, 1e-9))
    np.testing.assert_allclose(infinity, far, atol=1e-3)


@settings(deadline=None, max_examples=60)
@given(
    z_mm=st.floats(130.0, 20000.0),
    x_mm=st.floats(20.0, 80.0),
    sign=st.sampled_from([-1.0, 1.0]),
    k1=st.floats(-0.3, 0.3),
    v_known=st.booleans(),
)
def test_a_spot_gives_back_its_depth(z_mm: float, x_mm: float, sign: float, k1: float, v_known: bool) -> None:
    lens, ray = LENS._replace(k1=k1, k2=0.0, k3=0.0), RAY._replace(x_mm=sign * x_mm)
    u, v = (float(c) for c in spot_at_inverse_depth(lens, ray, 1 / z_mm))
    spot = MeasuredSpot(u, v, 0.1, 0.1) if v_known else MeasuredSpot(u, 0.0, 0.1, np.inf)
    found = estimate_depth(lens, ray, spot)
    assert 1 / float(found.inverse_depth_per_mm) == pytest.approx(z_mm, rel=1e-9)
    assert abs(float(found.across_sd)) < 1e-6


def test_derivatives_of_the_depth_are_those_of_the_estimate() -> None:
    u, v = (float(c) for c in spot_at_inverse_depth(LENS, RAY, 1 / 750.0))
    spot = MeasuredSpot(u + 0.2, v, 0.1, 0.1)

    def depth(lens: np.ndarray, ray: np.ndarray) -> jax.Array:
        return 1 / estimate_depth(Lens(*lens), Ray(*ray), spot).inverse_depth_per_mm

    at = np.array(LENS, float), np.array(RAY, float)
    found = estimate_depth(LENS, RAY, spot)
    for argument, ours in ((0, found.dz_dlens), (1, found.dz_dray)):
        numeric = []
        for i in range(len(at[argument])):
            step = np.zeros(len(at[argument]))
            step[i] = 1e-6 * max(1.0, abs(at[argument][i]))
            ahead, behind = list(at), list(at)
            ahead[argument] = at[argument] + step
            behind[argument] = at[argument] - step
            numeric.append(float(depth(*ahead) - depth(*behind)) / (2 * step[i]))
        # 1e-3: the curvature that the docstring says is neglected, here with a residual of 2 sd.
        np.testing.assert_allclose(ours, numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


@pytest.mark.parametrize("z_mm", [150.0, 600.0, 2500.0])
def test_the_range_s_deviation_is_r_squared_over_f_b(z_mm: float) -> None:
    """The closed form of a pinhole and a beam beside it, as the thesis's (4.3) differentiated."""
    lens, ray = Lens(541.0, 320.0, 240.0), Ray(60.0, 0.0, 0.0, 0.0)
    u, v = spot_at_inverse_depth(lens, ray, 1 / z_mm)
    found = estimate_depth(lens, ray, MeasuredSpot(float(u), float(v), 0.05, 0.05))
    assert float(found.z_sd_of_spot_mm) == pytest.approx(0.05 * z_mm**2 / (541.0 * 60.0), rel=1e-12)


def test_the_stated_deviation_is_that_of_many_spots() -> None:
    rng = np.random.default_rng(7)
    u, v = (float(c) for c in spot_at_inverse_depth(LENS, RAY, 1 / 900.0))
    noise = rng.normal(0.0, 0.05, (4000, 2))

    def depth(du: jax.Array, dv: jax.Array) -> jax.Array:
        return 1 / estimate_depth(LENS, RAY, MeasuredSpot(u + du, v + dv, 0.05, 0.05)).inverse_depth_per_mm

    depths = np.asarray(jax.vmap(depth)(*noise.T))
    stated = float(estimate_depth(LENS, RAY, MeasuredSpot(u, v, 0.05, 0.05)).z_sd_of_spot_mm)
    # The sd of 4000 draws is known to 1 / sqrt(2 x 4000) = 1.1 %: four of these.
    assert depths.std() == pytest.approx(stated, rel=0.045)
