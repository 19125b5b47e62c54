"""Where spots may be: peaks that stand out of the noise of the smoothed signal."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

import cv2
import numpy as np

from workbench.model.arrays import Float32Array, FloatArray
from workbench.spots.kernels.strip_pixels import peaks_of
from workbench.spots.strip import Strip

# White noise passes 5.5 sd once in 5e7 looks.
PEAK_SD: Final = 5.5
# Widths that the two searches are matched to: sharp spots, and spots so wide that no pixel stands out.
FINE_PX, COARSE_PX = 1.0, 3.0
_NO_MASK: Final = np.zeros((0, 0), bool)


class Peaks(NamedTuple):
    """Local maxima of the smoothed signal, highest first."""

    rows: FloatArray
    cols: FloatArray
    height_dn: FloatArray
    scale_px: float


def smoothed_sd(variance: float, scale_px: float) -> float:
    """Standard deviation of white noise of `variance` after a Gaussian of `scale_px`."""
    return math.sqrt(variance / (4.0 * math.pi)) / scale_px


@lru_cache(maxsize=8)
def _taps(scale_px: float) -> Float32Array:
    """(n,) weights of a Gaussian."""
    size = 2 * round(2.5 * scale_px) + 1
    return np.asarray(cv2.getGaussianKernel(size, scale_px), np.float32).ravel()


def find_peaks(
    signal: Float32Array,
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
    sd = smoothed_sd(variance, scale_px)
    mask = _NO_MASK if strip.mask is None else strip.mask
    row0, col0 = strip.rows.start, strip.cols.start
    peaks = peaks_of(signal, _taps(scale_px), mask, threshold_sd * sd, sd, row0, col0)
    return Peaks(peaks[:, 0].copy(), peaks[:, 1].copy(), peaks[:, 2], scale_px)
