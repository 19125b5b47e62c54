"""The fisheye against OpenCV's, against differences, and in its limits."""

from __future__ import annotations

import cv2
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.support.rigs import opencv_pixels
from workbench.optics.equidistant import EQUIDISTANT, SERIES_BELOW
from workbench.optics.undistort import undistort

LENS = np.array([305.2, 322.1, 236.4, 0.04, -0.03, 0.02, -0.006])
IDEAL = np.array([305.2, 322.1, 236.4, 0.0, 0.0, 0.0, 0.0])


def directions(widest_deg: float, n: int = 400) -> np.ndarray:
    """(n, 2) X/Z, Y/Z up to an angle off the axis, the axis itself among them."""
    rng = np.random.default_rng(3)
    angle, turn = np.radians(rng.uniform(0.0, widest_deg, n)), rng.uniform(0.0, 2 * np.pi, n)
    angle[0] = 0.0
    return np.asarray(np.tan(angle)[:, None] * np.stack((np.cos(turn), np.sin(turn)), axis=1))


@pytest.mark.parametrize("lens", [LENS, IDEAL])
def test_projection_is_opencv_s_up_to_80_degrees(lens: np.ndarray) -> None:
    xy = directions(80.0)
    expected = opencv_pixels("equidistant", lens.tolist(), np.column_stack((xy, np.ones(len(xy)))))
    for array in (np.asarray, jnp.asarray):
        ours = np.stack(EQUIDISTANT.project(lens, array(xy[:, 0]), array(xy[:, 1])), axis=1)
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-9)


def test_the_inverse_is_opencv_s() -> None:
    """OpenCV's ends where its own steps are 1e-8 of the angle; ours is held against the projection."""
    xy = directions(70.0)
    pixels = np.stack(EQUIDISTANT.project(LENS, xy[:, 0], xy[:, 1]), axis=1)
    np.testing.assert_allclose(undistort(EQUIDISTANT, LENS, pixels), xy, rtol=1e-11, atol=1e-12)
    camera = np.array([[LENS[0], 0, LENS[1]], [0, LENS[0], LENS[2]], [0, 0, 1]])
    theirs = cv2.fisheye.undistortPoints(pixels.reshape(-1, 1, 2), camera, LENS[3:]).reshape(-1, 2)
    np.testing.assert_allclose(theirs, xy, rtol=1e-6, atol=1e-6)


def test_an_ideal_fisheye_shows_the_angle() -> None:
    for degrees in (0.0, 1e-6, 1.0, 5.7, 5.8, 60.0, 89.0):
        u, v = EQUIDISTANT.project(IDEAL, np.array(np.tan(np.radians(degrees))), np.array(0.0))
        assert float(u) == pytest.approx(322.1 + 305.2 * np.radians(degrees), rel=1e-14)
        assert float(v) == 236.4


# On the axis, near it, on both sides of the radius where the series ends, and far out.
RADII = [0.0, 1e-9, 1e-4, 0.999 * SERIES_BELOW**0.5, 1.001 * SERIES_BELOW**0.5, 0.7, 2.0]


@pytest.mark.parametrize("radius", RADII)
def test_derivatives_are_those_of_differences_on_the_axis_too(radius: float) -> None:
    at = np.array([*LENS, 0.6 * radius, 0.8 * radius])

    def pixel(numbers: jax.Array) -> jax.Array:
        return jnp.stack(EQUIDISTANT.project(numbers[:7], numbers[7], numbers[8]))

    by_jax = np.asarray(jax.jacfwd(pixel)(at))
    step = 1e-6
    numeric = np.stack([np.asarray(pixel(at + d) - pixel(at - d)) for d in step * np.eye(9)], axis=1) / (
        2 * step
    )
    np.testing.assert_allclose(by_jax, numeric, rtol=1e-7, atol=1e-6)
    stepped = at[:, None] + 1e-30j * np.eye(9)
    complex_step = np.stack(EQUIDISTANT.project(stepped[:7], stepped[7], stepped[8])).imag / 1e-30
    np.testing.assert_allclose(complex_step, by_jax, rtol=1e-13, atol=1e-12)


def test_second_derivatives_are_finite_on_the_axis() -> None:
    def u(x: jax.Array, y: jax.Array) -> jax.Array:
        return jnp.asarray(EQUIDISTANT.project(LENS, x, y)[0])

    hessian = jax.hessian(u, argnums=(0, 1))(0.0, 0.0)
    np.testing.assert_allclose(hessian, np.zeros((2, 2)), atol=1e-12)  # an odd function
    third = jax.grad(jax.grad(jax.grad(u)))(0.0, 0.0)
    # x - x^3 / 3 + k1 x^3 + ...
    assert float(third) == pytest.approx(6 * LENS[0] * (LENS[3] - 1 / 3), rel=1e-12)


def test_the_model_folds_where_its_polynomial_in_the_angle_does() -> None:
    """With k1 alone theta_d is largest at theta = (-3 k1)^-1/2: at -0.3, 60.4 degrees."""
    lens = np.array([300.0, 0.0, 0.0, -0.3, 0.0, 0.0, 0.0])
    fold = 1 / np.sqrt(0.9)
    angles = fold * np.array([0.5, 0.99, 1.01, 1.3])
    unfolded = EQUIDISTANT.is_unfolded(lens, np.tan(angles), np.zeros(4))
    assert unfolded.tolist() == [True, True, False, False]
    beyond = 300.0 * fold * (1 - 0.3 * fold**2) * np.array([0.99, 1.01])
    found = undistort(EQUIDISTANT, lens, np.column_stack((beyond, np.zeros(2))))
    assert np.isfinite(found[:, 0]).tolist() == [True, False]
