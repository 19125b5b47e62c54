"""Points of a printed board on the plane of its target. Camera frame, millimetres."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.optics.rays import Plane


class Pose(NamedTuple):
    """Pose of a board on a plane: its centre at the plane's point (x, y), rotated by `roll` from x to y."""

    plane: Plane
    x_mm: ArrayLike
    y_mm: ArrayLike
    roll_rad: ArrayLike


def point_on_board(
    pose: Pose, across_mm: ArrayLike, down_mm: ArrayLike, into_mm: ArrayLike
) -> tuple[Array, Array, Array]:
    """Camera coordinates x, y, z of the board's points (right, down, into the paper); shapes broadcast.

    At roll 0 the board's x has no component along the camera's y. The three axes are orthonormal: the normal
    (-slope_x, -slope_y, 1), the direction (1, 0, slope_x) in the plane, and their cross product.
    """
    slope_x, slope_y = jnp.asarray(pose.plane.slope_x), jnp.asarray(pose.plane.slope_y)
    across, into = jnp.hypot(1.0, slope_x), jnp.sqrt(1.0 + slope_x**2 + slope_y**2)
    c, s = jnp.cos(pose.roll_rad), jnp.sin(pose.roll_rad)
    right, below = (c * across_mm - s * down_mm) / across, (s * across_mm + c * down_mm) / (across * into)
    behind = into_mm / into
    x = pose.x_mm + right - slope_x * slope_y * below - slope_x * behind
    y = pose.y_mm + (1.0 + slope_x**2) * below - slope_y * behind
    middle = pose.plane.z0_mm + slope_x * pose.x_mm + slope_y * pose.y_mm
    z = middle + slope_x * right + slope_y * below + behind
    return jnp.asarray(x), jnp.asarray(y), jnp.asarray(z)
