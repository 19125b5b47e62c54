"""Pinhole and Brown-Conrady lens, in OpenCV's convention (`plumb_bob`: k1 k2 p1 p2 k3)."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike
from numpy.typing import NDArray

from workbench.model.arrays import FloatArray

Numbers = TypeVar("Numbers", float, Array, FloatArray)
EitherArray = Array | NDArray[Any]
"""JAX's, or numpy's where all inputs are numpy's arrays."""


class Lens(NamedTuple):
    """Intrinsic parameters. f, cx, cy in pixels (square pixels), the others without unit."""

    f_px: ArrayLike
    cx_px: ArrayLike
    cy_px: ArrayLike
    k1: ArrayLike = 0.0
    k2: ArrayLike = 0.0
    p1: ArrayLike = 0.0
    p2: ArrayLike = 0.0
    k3: ArrayLike = 0.0


def as_array(x: ArrayLike) -> EitherArray:
    """JAX's, but for numpy's, which stays: so the same maths is done on complex numbers without a program."""
    return x if isinstance(x, np.ndarray) else jnp.asarray(x)


def distort(lens: Lens, x: ArrayLike, y: ArrayLike) -> tuple[EitherArray, EitherArray]:
    """Distorted normalised coordinates of the undistorted (x, y); shapes broadcast.

    Source: D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37 (1971), with
    OpenCV's order of coefficients.
    """
    x, y = as_array(x), as_array(y)
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    x_distorted = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x)
    y_distorted = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y
    return x_distorted, y_distorted


def project(lens: Lens, x: ArrayLike, y: ArrayLike) -> tuple[EitherArray, EitherArray]:
    """Pixel position (u, v) of the undistorted normalised coordinates x = X/Z, y = Y/Z."""
    x_distorted, y_distorted = distort(lens, x, y)
    f_px = as_array(lens.f_px)
    return as_array(lens.cx_px) + f_px * x_distorted, as_array(lens.cy_px) + f_px * y_distorted


def radial_slope(lens: Lens, x: Numbers, y: Numbers) -> Numbers:
    """d(distorted radius) / d(radius) at (x, y): where it is not positive the lens model folds over."""
    r2 = x * x + y * y
    # A lens of numbers may meet arrays: the type checker, which takes one kind at a time, does not see it.
    slope: Numbers = 1.0 + r2 * (3.0 * lens.k1 + r2 * (5.0 * lens.k2 + r2 * 7.0 * lens.k3))  # type: ignore[assignment]
    return slope
