"""Spot detection of the thesis behind this workbench, for comparison: threshold, scanline, centroid.

Deborah L. Tran, "Obstacle Detection for Robot Navigation Using Structured Light", MIT 2001, sections 3.4 and
5.2.3. Its centre is biased where the threshold truncates a spot, and it has no standard deviation.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, Image
from workbench.spots.frames import check_pair
from workbench.spots.strip import check_line, distance_px
from workbench.spots.types import Scanline

_FIRST_THRESHOLD_DN = 50.0
_MIN_THRESHOLD_DN = 4.0
_MAX_TRIES = 12


def thesis_centres(
    on: Image,
    off: Image | None = None,
    *,
    scanlines: Sequence[Scanline] = (),
    expected: int,
    ambiguous_px: float = 0.0,
) -> FloatArray:
    """(k, 2) centroids (u, v) in pixels, brightest first; k may differ from `expected`.

    Args:
        on: Frame with the lasers on.
        off: Frame with the lasers off; None where a filter blocks the ambient light.
        scanlines: Pixels farther than the half-width from all of them are dropped; none: all are kept.
        expected: Number of lasers: the threshold is halved while there are fewer spots, raised while there
            are more.
        ambiguous_px: Pixels closer than this to more than one scanline are dropped, as their laser is
            ambiguous.

    Raises:
        BadInputError: as `find_spots`.
    """
    on, off = check_pair(on, off)
    for line in scanlines:
        check_line(line)
    diff = on.astype(np.float64) if off is None else cv2.subtract(on, off).astype(np.float64)
    diff *= _allowed(diff.shape, scanlines, ambiguous_px)
    threshold, best = _FIRST_THRESHOLD_DN, np.zeros((0, 2))
    for _ in range(_MAX_TRIES):
        centres = _centroids(diff, threshold)
        if len(centres):
            best = centres
        if len(centres) == expected or threshold < _MIN_THRESHOLD_DN:
            break
        threshold *= 1.3 if len(centres) > expected else 0.5
    return best


def _allowed(shape: tuple[int, ...], scanlines: Sequence[Scanline], ambiguous_px: float) -> BoolArray:
    """(height, width): pixels on a scanline, and not close to two."""
    if not scanlines:
        return np.ones(shape, bool)
    v, u = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    distances = np.stack([distance_px(line, u, v) for line in scanlines])
    half_widths = np.array([line.half_width_px for line in scanlines])[:, None, None]
    on_a_line = np.logical_or.reduce(distances <= half_widths, axis=0)
    allowed: BoolArray = on_a_line & (np.count_nonzero(distances < ambiguous_px, axis=0) < 2)
    return allowed


def _centroids(diff: FloatArray, threshold: float) -> FloatArray:
    """(k, 2) centres of mass of the connected pixels above the threshold, by decreasing mass."""
    above = (diff > threshold).astype(np.uint8)
    count, labels = cv2.connectedComponents(above)
    kept = diff * above
    v, u = np.mgrid[: diff.shape[0], : diff.shape[1]]
    sums = [np.bincount(labels.ravel(), (kept * w).ravel(), count)[1:] for w in (1, u, v)]
    order = np.argsort(-sums[0], kind="stable")
    centres: FloatArray = np.stack([sums[1], sums[2]], axis=1)[order] / sums[0][order, None]
    return centres
