"""Scanning head of the virtual bench: the true ray of its laser at a reading of its encoder."""

from __future__ import annotations

from math import atan, cos, radians, sin

import numpy as np

from workbench.emulator.keyed import generator
from workbench.emulator.spec import EmulatorSpec
from workbench.emulator.truth import TrueHead, TrueRay


def reading_error_deg(head: TrueHead, spec: EmulatorSpec, key: str, reading_deg: float) -> float:
    """Error of the encoder's reading in one move, equal whenever the same move is repeated."""
    rng = generator(spec.seed, "head", key, f"{reading_deg!r}")
    return head.reading_sd_deg * float(rng.standard_normal())


def turned(axis_ray: TrueRay, head: TrueHead, reading_deg: float) -> TrueRay:
    """Ray of the laser where the encoder reads an angle.

    The beam is built at the angle 0 and turned, in this order, about the axis and with it.
    """
    from scipy.spatial.transform import Rotation  # takes long to load; only a head needs it

    a, b = head.eccentricity_cos_deg, head.eccentricity_sin_deg
    at = radians(reading_deg)
    turn_deg = (1.0 + head.scale) * reading_deg + a * (cos(at) - 1.0) + b * sin(at)
    # A right-handed turn about y (down) moves z (forward) towards x (right).
    about_axis = Rotation.from_rotvec([0.0, atan(axis_ray.tx) + radians(turn_deg), 0.0])
    axis = np.array([head.axis_slope_x, 1.0, head.axis_slope_z])
    axis /= np.linalg.norm(axis)
    across = np.cross([0.0, 1.0, 0.0], axis)
    length = float(np.linalg.norm(across))
    tilt = Rotation.from_rotvec(across * (np.arctan2(length, axis[1]) / length if length > 0 else 0.0))
    direction = (tilt * about_axis).apply([0.0, axis_ray.ty, 1.0])
    point = np.array([axis_ray.x_mm, axis_ray.y_mm, head.axis_z_mm])
    point = point + (tilt * about_axis).apply([head.beam_offset_mm, 0.0, 0.0])
    tx, ty = direction[0] / direction[2], direction[1] / direction[2]
    return TrueRay(float(point[0] - tx * point[2]), float(point[1] - ty * point[2]), float(tx), float(ty))
