"""The image: positions inside it, and the deviation of a laser's spots from a straight line."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.model.arrays import BoolArray, FloatArray
from workbench.optics.lens import LensModel
from workbench.optics.rays import Ray, spot_at_inverse_depth

STRAIGHT_PX = 1.0
"""Deviation below which a laser's line counts as straight."""
LEAST_LENGTH_PX = 1e-9
"""Length of a direction below which the spot does not move, and its line has no bend."""
BEND_POINTS = 17
"""Number of spots at which a laser's line is evaluated, from infinity to the nearest depth."""


def inside_px(position_px: ArrayLike, size_px: ArrayLike) -> BoolArray:
    """(..., 2) whether each coordinate u, v of positions (..., 2) lies in an image (width, height).

    The centre of the first pixel is 0, its outer edge -0.5. NaN is not inside.
    """
    position, size = np.asarray(position_px, float), np.asarray(size_px, float)
    return np.asarray((position >= -0.5) & (position < size - 0.5))


def in_picture(position_px: ArrayLike, size_px: ArrayLike) -> BoolArray:
    """(...) whether both coordinates of positions (..., 2) lie in an image (width, height)."""
    return np.asarray(inside_px(position_px, size_px).all(axis=-1))


def extent_px(direction: FloatArray, size_px: tuple[int, int]) -> float:
    """Length of the line through the middle of an image (width, height) along a unit vector (2,)."""
    return 1.0 / float((np.abs(direction) / size_px).max())


def bend_px(
    model: LensModel,
    lens: FloatArray,
    ray: FloatArray,
    nearest_mm: float,
    size_px: tuple[int, int],
    line: tuple[ArrayLike, ArrayLike],
) -> float:
    """Largest distance of a laser's spots from a straight line, px; 0 if below `STRAIGHT_PX`.

    Spots outside the image or beyond the fold of the lens model do not count.

    Args:
        model: lens model.
        lens: (P,) parameters of the lens, in the model's order.
        ray: (4,) parameters of the laser's ray.
        nearest_mm: depth of the nearest spot; the farthest is at infinity.
        size_px: (width, height) of the image.
        line: a point of the line, (2,) pixels, and its direction (2,), of any length.
    """
    x_mm, y_mm, tx, ty = ray
    inverse_depth = np.linspace(0.0, 1.0 / nearest_mm, BEND_POINTS)
    spots = np.stack(spot_at_inverse_depth(model, lens, Ray(*ray), inverse_depth), axis=1)
    seen = model.is_unfolded(lens, tx + x_mm * inverse_depth, ty + y_mm * inverse_depth)
    seen &= in_picture(spots, size_px)
    point, (du, dv) = line[0], np.asarray(line[1], float)
    away = np.abs((spots - point) @ [dv, -du]) / max(float(np.hypot(du, dv)), LEAST_LENGTH_PX)
    bend = float(away[seen].max(initial=0.0))
    return bend if bend > STRAIGHT_PX else 0.0
