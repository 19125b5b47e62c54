"""Corners of a board located to a pixel, as the sub-pixel fit starts from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.model.arrays import FloatArray, IndexArray

NEIGHBOURS = 8
"""Points for the local scale at a corner: of the two markers that touch it, or the corners around it."""


@dataclass(frozen=True)
class LocatedCorners:
    """The k corners of a board that a detector found."""

    ids: IndexArray
    """(k,) rows in the board's `corners_mm`."""
    position_px: FloatArray
    """(k, 2) to a pixel."""
    px_per_mm: FloatArray
    """(k, 2, 2) derivatives of the pixel position by the board's x and y (columns)."""
    side_mm: float
    """Length of the edges that meet at a corner."""
    clear_mm: float
    """Distance from these edges to the next print beside them, such as a marker."""
    found: str
    """Finding of the detector, for messages."""


def local_scale(
    at_mm: FloatArray, points_mm: FloatArray, points_px: FloatArray, neighbours: int = NEIGHBOURS
) -> FloatArray:
    """(k, 2, 2) derivatives of the pixel position by the board's x, y at points (k, 2), from those nearby.

    Args:
        at_mm: (k, 2) points of the board.
        points_mm: (m, 2) points of the board with a known position in the image.
        points_px: (m, 2) that position.
        neighbours: number of points nearby.
    """
    matrices = []
    for point in at_mm:
        near = np.argsort(((points_mm - point) ** 2).sum(axis=1))[:neighbours]
        design = np.column_stack([points_mm[near] - point, np.ones(len(near))])
        matrices.append(np.linalg.lstsq(design, points_px[near], rcond=None)[0][:2].T)
    return np.array(matrices).reshape(-1, 2, 2)


def stretched(mean: FloatArray) -> NDArray[np.uint8]:
    """The frame with its contrast stretched to 8 bits; in room light the board may span a few levels only."""
    dark, bright = np.percentile(mean, (1, 99))
    return np.asarray(np.clip((mean - dark) / max(bright - dark, 1e-9) * 255, 0, 255), np.uint8)


def as_ids(found: object) -> IndexArray:
    """Ids as an array; OpenCV returns None for no ids."""
    return np.array([], np.intp) if found is None else np.asarray(found, np.intp).ravel()
