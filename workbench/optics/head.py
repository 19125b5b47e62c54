"""Scanning head: the ray of a laser that turns about an axis. Camera frame, millimetres, radians.

The axis passes through the point (x, y, z) with the direction (slope_x, 1, slope_z). It is the y axis of the
head's frame, which is the camera's turned by the smallest rotation that maps y to the axis. There, the beam
at the angle phi has the direction (sin phi, ty, cos phi), and passes the axis at `beam_offset_mm`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.optics.rays import Ray


class Head(NamedTuple):
    """Parameters of a head beyond those of its laser's ray, in the order of `HEAD`."""

    axis_z_mm: ArrayLike
    axis_slope_x: ArrayLike
    axis_slope_z: ArrayLike
    beam_offset_mm: ArrayLike
    scale: ArrayLike
    eccentricity_cos_rad: ArrayLike
    """Error of the encoder, a (cos(reading) - 1) + b sin(reading): a. At the reading 0 there is none."""
    eccentricity_sin_rad: ArrayLike
    """b"""


def beam_angle(ray: Ray, head: Head, reading_rad: ArrayLike) -> Array:
    """Angle of the beam about the axis, from z towards x, by the encoder's reading; shapes broadcast."""
    reading = jnp.asarray(reading_rad)
    eccentric = head.eccentricity_cos_rad * (jnp.cos(reading) - 1.0) + head.eccentricity_sin_rad * jnp.sin(
        reading
    )
    return jnp.asarray(jnp.arctan(ray.tx) + (1.0 + head.scale) * reading + eccentric)


def turned_ray(ray: Ray, head: Head, reading_rad: ArrayLike) -> Ray:
    """Ray of the laser at a reading of the encoder; shapes broadcast.

    Args:
        ray: position of the axis (x, y), tangent of the beam's angle at the reading 0, inclination.
        head: further parameters.
        reading_rad: reading.
    """
    angle = beam_angle(ray, head, reading_rad)
    s, c = jnp.sin(angle), jnp.cos(angle)
    norm = jnp.sqrt(1.0 + jnp.square(head.axis_slope_x) + jnp.square(head.axis_slope_z))
    axis = (head.axis_slope_x / norm, 1.0 / norm, head.axis_slope_z / norm)
    direction = _tilted(axis, s, jnp.asarray(ray.ty), c)
    offset_mm = jnp.asarray(head.beam_offset_mm)
    from_axis = _tilted(axis, offset_mm * c, jnp.zeros(()), -offset_mm * s)
    x, y, z = ray.x_mm + from_axis[0], ray.y_mm + from_axis[1], head.axis_z_mm + from_axis[2]
    tx, ty = direction[0] / direction[2], direction[1] / direction[2]
    return Ray(x - tx * z, y - ty * z, tx, ty)


def _tilted(axis: tuple[ArrayLike, ...], x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """The vector turned by the smallest rotation that maps (0, 1, 0) to the unit vector `axis`.

    With w = y x axis = (a_z, 0, -a_x) and c = a_y, the rotation is v + w x v + w x (w x v) / (1 + c).
    """
    ax, c, az = (jnp.asarray(part) for part in axis)
    wx, wz = az, -ax
    first = (-wz * y, wz * x - wx * z, wx * y)
    second = (-wz * first[1], wz * first[0] - wx * first[2], wx * first[1])
    return (
        x + first[0] + second[0] / (1.0 + c),
        y + first[1] + second[1] / (1.0 + c),
        z + first[2] + second[2] / (1.0 + c),
    )
