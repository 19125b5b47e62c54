"""Where spots may be: peaks that stand out of the noise of the smoothed signal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.spots.strip import Strip
from workbench.spots.types import Floats

# White noise passes 5.5 sd once in 5e7 looks.
PEAK_SD: Final = 5.5
# Widths that the two searches are matched to: sharp spots, and spots so wide that no pixel stands out.
FINE_PX, COARSE_PX = 1.0, 3.0
_MAX_PEAKS = 64


@dataclass(frozen=True, slots=True)
class Peaks:
    """Local maxima of the smoothed signal, highest first."""

    rows: NDArray[np.intp]
    cols: NDArray[np.intp]
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
    image = cv2.GaussianBlur(signal, (size, size), scale_px, borderType=cv2.BORDER_REPLICATE)
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
    return Peaks(rows + strip.rows.start, cols + strip.cols.start, heights / sd, heights, scale_px)


_NEIGHBOURS = np.ones((3, 3), np.uint8)
