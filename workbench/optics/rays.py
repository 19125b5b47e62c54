"""Laser rays and the images of their points. Camera frame: x right, y down, z forward, millimetres."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.optics.lens import EitherArray, LensModel, Numbers, as_array

RAY = ("x_mm", "y_mm", "tx", "ty")
"""Names of a ray's parameters, in the order of `Ray`."""


class Ray(NamedTuple):
    """The points (x + tx z, y + ty z, z) of a laser beam: origin (x, y, 0) mm, direction (tx, ty, 1)."""

    x_mm: ArrayLike
    y_mm: ArrayLike
    tx: ArrayLike
    ty: ArrayLike


class Plane(NamedTuple):
    """The points with z = z0 + slope_x x + slope_y y; a slope is the tangent of the tilt."""

    z0_mm: ArrayLike
    slope_x: ArrayLike = 0.0
    slope_y: ArrayLike = 0.0


def depth_on_plane(ray: Ray, plane: Plane) -> Array:
    """Depth z in mm at which the ray meets the plane; shapes broadcast."""
    at_origin = plane.z0_mm + plane.slope_x * ray.x_mm + plane.slope_y * ray.y_mm
    return jnp.asarray(at_origin / (1.0 - plane.slope_x * ray.tx - plane.slope_y * ray.ty))


def spot_at_inverse_depth(
    model: LensModel, lens: Numbers, ray: Ray, inverse_depth_per_mm: ArrayLike
) -> tuple[EitherArray, EitherArray]:
    """Pixel position (u, v) of the ray's point at depth z = 1 / inverse_depth; 0 is the vanishing point.

    The undistorted image point is linear in the inverse depth, which is why the ranger solves for it, not for
    z.

    Args:
        model: lens model.
        lens: parameters of the lens, in the model's order.
        ray: the laser.
        inverse_depth_per_mm: 1 / z; shapes broadcast.
    """
    x = ray.tx + ray.x_mm * as_array(inverse_depth_per_mm)
    y = ray.ty + ray.y_mm * as_array(inverse_depth_per_mm)
    return model.project(lens, x, y)


def spot_on_plane(model: LensModel, lens: Numbers, ray: Ray, plane: Plane) -> tuple[Array, Array]:
    """Pixel position (u, v) of the laser's spot on the plane."""
    u, v = spot_at_inverse_depth(model, lens, ray, 1.0 / depth_on_plane(ray, plane))
    return jnp.asarray(u), jnp.asarray(v)
