"""Strip of an image around a scanline."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.errors import BadInputError
from workbench.spots.types import Scanline

# Rows beyond the band, for the smoothing at its rim.
_RIM_PX = 3


@dataclass(frozen=True, slots=True)
class Strip:
    """Rectangle of the image, and the mask of its pixels within the scanline's half-width."""

    rows: slice
    cols: slice
    mask: BoolArray | None
    """None: spots are allowed in every pixel."""

    @property
    def at(self) -> tuple[slice, slice]:
        """Index of the rectangle in the image."""
        return self.rows, self.cols


def distance_px(line: Scanline, u_px: FloatArray, v_px: FloatArray) -> FloatArray:
    """(n,) distances of points from the line."""
    across = (u_px - line.u0_px) * line.dv - (v_px - line.v0_px) * line.du
    distance: FloatArray = np.abs(across) / np.hypot(line.du, line.dv)
    return distance


def is_on(line: Scanline, u_px: float, v_px: float) -> bool:
    """Whether a point lies within the line's half-width."""
    across = (u_px - line.u0_px) * line.dv - (v_px - line.v0_px) * line.du
    return abs(across) <= line.half_width_px * math.hypot(line.du, line.dv)


def check_line(line: Scanline) -> None:
    """Refuse a line without direction or width, or with a value that is not finite.

    Raises:
        BadInputError: the line is refused.
    """
    values = (line.u0_px, line.v0_px, line.du, line.dv, line.half_width_px)
    if not np.isfinite(values).all() or line.half_width_px <= 0 or (line.du == 0 and line.dv == 0):
        raise BadInputError(
            f"scanline: expected finite numbers, a direction other than (0, 0) and a half-width above 0, "
            f"got {line}; use for example Scanline(0, 240, 1, 0, 3) for row 240"
        )


def strip_of(line: Scanline, shape: tuple[int, int]) -> Strip:
    """Smallest rectangle of an image of `shape` around the scanline's band and a rim.

    The strip of a band outside the image is empty.
    """
    height, width = shape
    reach = line.half_width_px + _RIM_PX
    if abs(line.du) >= abs(line.dv):
        ends = line.v0_px + (np.array([0.0, width - 1.0]) - line.u0_px) * line.dv / line.du
        rows, cols = _span(ends, reach * np.hypot(1.0, line.dv / line.du), height), slice(0, width)
    else:
        ends = line.u0_px + (np.array([0.0, height - 1.0]) - line.v0_px) * line.du / line.dv
        rows, cols = slice(0, height), _span(ends, reach * np.hypot(1.0, line.du / line.dv), width)
    v, u = np.mgrid[rows, cols].astype(np.float64)
    return Strip(rows, cols, distance_px(line, u, v) <= line.half_width_px + 1.0)


def _span(ends: FloatArray, reach: float, size: int) -> slice:
    first = int(np.clip(np.floor(ends.min() - reach), 0, size))
    last = int(np.clip(np.ceil(ends.max() + reach) + 1, first, size))
    return slice(first, last)
