"""The picture: which positions lie in it, and how far a laser's spots in it stray from a straight line."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.model.arrays import BoolArray, FloatArray
from workbench.optics.lens import LensModel
from workbench.optics.rays import Ray, spot_at_inverse_depth

STRAIGHT_PX = 1.0
"""A laser's line that bends by less counts as straight."""
LEAST_LENGTH_PX = 1e-9
"""A direction that is shorter belongs to a spot that does not move: its line does not bend."""
BEND_POINTS = 17
"""Spots of a laser at which its line is evaluated, from infinity to the nearest depth."""


def inside_px(position_px: ArrayLike, size_px: ArrayLike) -> BoolArray:
    """(..., 2) whether each coordinate u, v of positions (..., 2) lies in a picture (width, height).

    The centre of the first pixel is 0, its outer edge -0.5. A coordinate that is NaN lies nowhere.
    """
    position, size = np.asarray(position_px, float), np.asarray(size_px, float)
    return np.asarray((position >= -0.5) & (position < size - 0.5))


def in_picture(position_px: ArrayLike, size_px: ArrayLike) -> BoolArray:
    """(...) whether positions (..., 2) lie in a picture (width, height), both coordinates of them."""
    return np.asarray(inside_px(position_px, size_px).all(axis=-1))


def bend_px(
    model: LensModel,
    lens: FloatArray,
    ray: FloatArray,
    nearest_mm: float,
    size_px: tuple[int, int],
    line: tuple[ArrayLike, ArrayLike],
) -> float:
    """Largest distance of a laser's spots from a straight line; 0 if below `STRAIGHT_PX`.

    Of spots in the picture, before the lens model folds over.

    Args:
        model: kind of lens.
        lens: (P,) its parameters, in the model's order.
        ray: (4,) the laser's.
        nearest_mm: depth of the nearest spot; the farthest is at infinity.
        size_px: (width, height) of the picture.
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
