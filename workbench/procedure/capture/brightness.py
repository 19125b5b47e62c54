"""Brightness of the brightest spot in a trial exposure; only light of the lasers counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.calibration.data.spot_rows import prior_scanlines
from workbench.model.arrays import BoolArray, Image
from workbench.model.rig import Rig
from workbench.spots.strip import distance_px

DETECTION_SD = 6.0
"""Threshold of laser light in noise sd. The maximum of 10^5 Gaussian numbers, one per pixel, is 4.4 sd."""
LEAST_NOISE_DN = 0.5
"""Lower bound of the noise of a difference of two frames; rounding alone gives sqrt(2 / 12)."""
SD_PER_MAD = 1.4826
"""Ratio of the standard deviation to the median absolute deviation of Gaussian noise."""
OUTLIER_SD = 4.0
"""Distance from the median, in sd, beyond which a difference is an outlier."""


@dataclass(frozen=True)
class Brightness:
    """Brightness in a trial exposure, as shares of full scale."""

    peak: float
    """Brightest pixel with laser light; without any, the median of the dark frames."""
    lit: float = 0.0
    """Part of `peak` due to the lasers; 0 if they are not seen."""
    noise: float = 0.0
    """Standard deviation of `lit`."""


def searched_pixels(rig: Rig, head_deg: float = 0.0) -> BoolArray:
    """Mask (height, width) of pixels near the scanlines of the rig's lasers; all pixels if there are none.

    Args:
        rig: rig with the lasers.
        head_deg: reading of its scanning head.
    """
    v, u = np.mgrid[0 : rig.camera.height_px, 0 : rig.camera.width_px].astype(float)
    lines = prior_scanlines(rig, head_deg)
    on_a_line = np.logical_or.reduce([distance_px(line, u, v) <= line.half_width_px for line in lines])
    return on_a_line if on_a_line.any() else np.ones_like(on_a_line)


def measure_brightness(
    on: Sequence[Image], off: Sequence[Image], searched: BoolArray, full_scale: int
) -> Brightness:
    """Measure the brightest pixel with laser light.

    A flickering lamp is as bright in dark frames as in lit ones, or it differs between frames of one kind.
    The criterion for laser light at a pixel is therefore min(lit frames) - max(dark frames) - its largest
    difference between frames of one kind.

    Args:
        on: two frames with the lasers on, (height, width).
        off: two frames with the lasers off, one before and one after these.
        searched: mask of the pixels to search, (height, width).
        full_scale: largest value of a pixel.
    """
    lit = np.stack([image[searched] for image in on]).astype(np.int32)
    dark = np.stack([image[searched] for image in off]).astype(np.int32)
    noise = max(_typical_sd(dark[0] - dark[1]), LEAST_NOISE_DN)
    unsteady = np.maximum(np.ptp(lit, axis=0), np.ptp(dark, axis=0))
    certain = lit.min(axis=0) - dark.max(axis=0) - unsteady
    where = int(certain.argmax())
    if certain[where] <= DETECTION_SD * noise:
        return Brightness(float(np.median(dark)) / full_scale)
    gained = float(lit[:, where].mean() - dark[:, where].mean())
    return Brightness(int(lit[:, where].max()) / full_scale, gained / full_scale, noise / full_scale)


def _typical_sd(differences: NDArray[np.int32]) -> float:
    """Standard deviation about the median without outliers, which a lamp may cause."""
    distance = np.abs(differences - np.median(differences))
    # Half a unit is added because the median of whole numbers is rounded.
    inliers = distance <= OUTLIER_SD * SD_PER_MAD * (np.median(distance) + 0.5)
    return float(np.std(differences[inliers]))
