"""Where spots may be: peaks that stand out of the noise of a smoothed difference image."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.spots.types import Floats

Floats32 = NDArray[np.float32]
_SAMPLES = 4096
_HALF_NORMAL = 1.4826
_CLIP_SD = 4.0
# Of the smoothed noise. White noise passes 5.5 sd once in 5e7 looks.
PEAK_SD = 5.5
# Widths (pixels) that the two searches are matched to: one for sharp spots, one for wide and dim ones.
SCALES_PX = (1.0, 3.0)


def level_and_sd(values: NDArray[np.generic], floor_sd: float = 0.0) -> tuple[float, float]:
    """Robust mean and standard deviation of pixels among which a few are spots.

    Median and MAD first, then mean and deviation of what lies within 4 sd of them: the first resist the spots,
    the second are efficient and free of the rounding of whole numbers.
    """
    sample = values.ravel()[:: max(1, values.size // _SAMPLES)].astype(np.float64)
    middle = float(np.median(sample))
    spread = max(_HALF_NORMAL * float(np.median(np.abs(sample - middle))), floor_sd)
    if spread == 0.0:
        spread = float(np.std(sample)) or 1.0
    kept = sample[np.abs(sample - middle) <= _CLIP_SD * spread]
    if kept.size == 0:
        return middle, spread
    return float(kept.mean()), max(float(kept.std()), floor_sd)


def smoothed(diff: Floats32, scale_px: float) -> Floats32:
    """`diff` smoothed by a Gaussian of `scale_px`."""
    return cast(Floats32, cv2.GaussianBlur(diff, (0, 0), scale_px, borderType=cv2.BORDER_REPLICATE))


def peaks(diff: Floats32, scale_px: float, threshold_sd: float = PEAK_SD) -> list[tuple[int, int, float]]:
    """Local maxima (row, column, height in sd) of the smoothed image above the threshold, highest first."""
    image = smoothed(diff, scale_px)
    level, sd = level_and_sd(image, floor_sd=0.1 / scale_px)
    size = 2 * round(1.5 * scale_px) + 1
    top = cv2.dilate(image, np.ones((size, size), np.uint8))
    rows, cols = np.nonzero((image >= top) & (image > level + threshold_sd * sd))
    heights = (image[rows, cols] - level) / sd
    order = np.argsort(-heights, kind="stable")
    return [(int(rows[i]), int(cols[i]), float(heights[i])) for i in order]


def rough_width_px(window: Floats, level: float) -> float:
    """Width of a spot from the number of pixels above half its height (2 pi ln 2 widths squared)."""
    height = float(window.max()) - level
    above = int((window > level + 0.5 * height).sum())
    return float(np.sqrt(max(above, 1) / (2.0 * np.pi * np.log(2.0))))
