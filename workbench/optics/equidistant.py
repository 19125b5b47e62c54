"""Lens model `equidistant`: OpenCV's fisheye, whose distorted radius is a polynomial in the angle.

With theta the angle off the axis, theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) is
the distorted radius. Directions up to 90 degrees off the axis have coordinates x = X/Z, y = Y/Z.

Source: J. Kannala and S. S. Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", IEEE PAMI 28 (2006) 1335, as in OpenCV.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.lens import EitherArray, LensModel, Numbers

SERIES_BELOW = 0.01
"""Squared radius below which atan(r) / r is its power series, which has no singularity at r = 0."""
SERIES_TERMS = 9
"""Number of terms; the first omitted one is below 0.01^9 / 19 = 5e-20."""


def _distort(coefficients: Numbers, x: EitherArray, y: EitherArray) -> tuple[EitherArray, EitherArray]:
    r2 = x * x + y * y
    angle_over_radius = _angle_over_radius(r2)
    k1, k2, k3, k4 = coefficients
    angle2 = r2 * angle_over_radius**2
    radial = angle_over_radius * (1.0 + angle2 * (k1 + angle2 * (k2 + angle2 * (k3 + angle2 * k4))))
    return x * radial, y * radial


def _undistorted_radius(angle_rad: FloatArray) -> FloatArray:
    """Tangent of an angle off the axis; infinite from 90 degrees."""
    seen = angle_rad < np.pi / 2
    return np.where(seen, np.tan(np.where(seen, angle_rad, 0.0)), np.inf)


def _angle_over_radius(r2: EitherArray) -> EitherArray:
    """atan(r) / r as a function of r^2, analytic at r = 0.

    JAX evaluates derivatives of both branches everywhere, so each branch gets safe inputs where the other is
    selected.
    """
    xp: Any = jnp if isinstance(r2, jnp.ndarray) else np
    near = r2.real < SERIES_BELOW
    small, large = xp.where(near, r2, 0.0), xp.where(near, 1.0, r2)
    series = xp.zeros_like(small)
    for n in reversed(range(SERIES_TERMS)):
        series = (-1.0) ** n / (2 * n + 1) + small * series
    radius = xp.sqrt(large)
    found: EitherArray = xp.where(near, series, xp.arctan(radius) / radius)
    return found


EQUIDISTANT = LensModel(
    name="equidistant",
    distort=_distort,
    radial_terms=("k1", "k2", "k3", "k4"),
    undistorted_radius=_undistorted_radius,
    trial_sd={"k1": 0.1, "k2": 0.1, "k3": 0.1, "k4": 0.1},
    terms=("k4", "k3", "k2", "k1"),
)
