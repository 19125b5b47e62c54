"""Detection: significant local maxima of the smoothed signal."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

import cv2
import numpy as np

from workbench.model.arrays import Float32Array, FloatArray
from workbench.spots.kernels.strip_pixels import peaks_of
from workbench.spots.strip import Strip

# Detection threshold; white noise exceeds 5.5 sd at one position in 5e7.
PEAK_SD: Final = 5.5
# Widths of the matched filters of the two searches: sharp spots, and spots without a significant pixel.
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
    """(n,) weights of a sampled Gaussian."""
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
        signal: (height, width) signal of the strip without its level, DN.
        strip: Position of the strip, and which of its pixels count.
        variance: Noise variance of a pixel, DN^2.
        scale_px: Width of the smoothing Gaussian.
        threshold_sd: Least height, in standard deviations of the smoothed noise.
    """
    sd = smoothed_sd(variance, scale_px)
    mask = _NO_MASK if strip.mask is None else strip.mask
    row0, col0 = strip.rows.start, strip.cols.start
    peaks = peaks_of(signal, _taps(scale_px), mask, threshold_sd * sd, sd, row0, col0)
    return Peaks(peaks[:, 0].copy(), peaks[:, 1].copy(), peaks[:, 2], scale_px)
