"""Where spots may be: peaks that stand out of the noise of the smoothed signal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.spots.strip import Strip
from workbench.spots.types import Floats

Ints = NDArray[np.intp]

# White noise passes 5.5 sd once in 5e7 looks.
PEAK_SD: Final = 5.5
# Widths that the two searches are matched to: sharp spots, and spots so wide that no pixel stands out.
FINE_PX, COARSE_PX = 1.0, 3.0
_MAX_PEAKS = 64
_NEIGHBOURS: Final = np.ones((3, 3), np.uint8)
# Peaks nearer than this are one unless a valley lies between them, this deep in sd and as a share of the
# lower.
_NEAR_PX: Final = 16.0
_VALLEY_SD: Final = 3.0
_VALLEY_SHARE: Final = 0.08


@dataclass(frozen=True, slots=True)
class Peaks:
    """Local maxima of the smoothed signal, highest first."""

    rows: Ints
    cols: Ints
    height_sd: Floats
    height_dn: Floats
    scale_px: float


def smoothed_sd(variance: float, scale_px: float) -> float:
    """Standard deviation of white noise of `variance` after a Gaussian of `scale_px`."""
    return float(np.sqrt(variance / (4.0 * np.pi))) / scale_px


def find_peaks(
    signal: NDArray[np.float32],
    strip: Strip,
    variance: float,
    scale_px: float = FINE_PX,
    threshold_sd: float = PEAK_SD,
) -> Peaks:
    """Peaks of a strip's signal, in pixels of the image.

    Args:
        signal: The strip's signal without its level, DN.
        strip: Where it lies, and which of its pixels count.
        variance: Of a pixel's noise, DN^2.
        scale_px: Width of the smoothing.
        threshold_sd: In standard deviations of the smoothed noise.
    """
    size = 2 * round(2.5 * scale_px) + 1
    blurred = cv2.GaussianBlur(signal, (size, size), scale_px, borderType=cv2.BORDER_REPLICATE)
    image = np.asarray(blurred, np.float32)
    sd = smoothed_sd(variance, scale_px)
    top = image >= cv2.dilate(image, _NEIGHBOURS)
    top &= image > threshold_sd * sd
    if strip.mask is not None:
        top &= strip.mask
    at = np.flatnonzero(top)
    heights = image.reshape(-1)[at].astype(np.float64)
    order = np.argsort(-heights, kind="stable")[:_MAX_PEAKS]
    rows, cols = np.divmod(at[order], image.shape[1])
    heights = heights[order]
    if len(order) > 1:
        kept = _separate(image, rows, cols, heights, sd)
        rows, cols, heights = rows[kept], cols[kept], heights[kept]
    return Peaks(rows + strip.rows.start, cols + strip.cols.start, heights / sd, heights, scale_px)


def _separate(image: NDArray[np.float32], rows: Ints, cols: Ints, heights: Floats, sd: float) -> list[int]:
    """Indices of the peaks that are not ripples on a higher one: noise on a wide spot, a clipped plateau."""
    kept: list[int] = []
    points = list(zip(rows.tolist(), cols.tolist(), heights.tolist(), strict=True))
    for i, (row, col, height) in enumerate(points):
        depth = max(_VALLEY_SD * sd, _VALLEY_SHARE * height)
        for k in kept:
            dv, du = points[k][0] - row, points[k][1] - col
            if abs(du) > _NEAR_PX or abs(dv) > _NEAR_PX:
                continue
            steps = np.linspace(0.0, 1.0, 2 * max(abs(du), abs(dv)) + 1)
            between = image[np.rint(row + steps * dv).astype(int), np.rint(col + steps * du).astype(int)]
            if height - float(between.min()) < depth:
                break
        else:
            kept.append(i)
    return kept
