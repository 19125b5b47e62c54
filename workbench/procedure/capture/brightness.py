"""How bright the brightest spot of a trial is: nothing but what the lasers light counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.model.arrays import BoolArray, Image
from workbench.model.rig import Rig
from workbench.spots.strip import distance_px

SURE_SD = 6.0
"""A band has some 10^5 pixels: the largest of so many Gaussian numbers lies at 4.4 sd."""
LEAST_NOISE_DN = 0.5
"""Of a difference of two frames, each rounded to whole numbers: sqrt(2 / 12)."""
SD_PER_MAD = 1.4826
"""Of Gaussian noise."""
OUTLYING_SD = 4.0


@dataclass(frozen=True)
class Brightness:
    """Shares of full scale."""

    peak: float
    """Brightest pixel that the lasers light; where they light none, the median of the darks."""
    lit: float = 0.0
    """How much of it is the lasers'; 0 where they are not seen."""
    noise: float = 0.0
    """Standard deviation of `lit`."""


def searched_pixels(rig: Rig) -> BoolArray:
    """Where the rig file lets its lasers' spots lie, or everywhere if that is beside the picture.

    Shape (height, width).
    """
    v, u = np.mgrid[0 : rig.camera.height_px, 0 : rig.camera.width_px].astype(float)
    lines = [prior_scanline(rig, laser) for laser in rig.lasers]
    on_a_line = np.logical_or.reduce([distance_px(line, u, v) <= line.half_width_px for line in lines])
    return on_a_line if on_a_line.any() else np.ones_like(on_a_line)


def measure_brightness(
    on: Sequence[Image], off: Sequence[Image], searched: BoolArray, full_scale: int
) -> Brightness:
    """What the lasers light most.

    A lamp that flickers is as bright in a dark frame as in a lit one, or differs between frames alike. So a
    pixel counts by its least number in the lit frames, less its largest in the dark ones, less its largest
    difference between frames that should be the same.

    Args:
        on: two frames with the lasers lit, (height, width).
        off: two with them off, one before and one after these.
        searched: where to look, (height, width).
        full_scale: the largest number of a pixel.
    """
    lit = np.stack([image[searched] for image in on]).astype(np.int32)
    dark = np.stack([image[searched] for image in off]).astype(np.int32)
    noise = max(_typical_sd(dark[0] - dark[1]), LEAST_NOISE_DN)
    unsteady = np.maximum(np.ptp(lit, axis=0), np.ptp(dark, axis=0))
    sure = lit.min(axis=0) - dark.max(axis=0) - unsteady
    where = int(sure.argmax())
    if sure[where] <= SURE_SD * noise:
        return Brightness(float(np.median(dark)) / full_scale)
    gained = float(lit[:, where].mean() - dark[:, where].mean())
    return Brightness(int(lit[:, where].max()) / full_scale, gained / full_scale, noise / full_scale)


def _typical_sd(differences: NDArray[np.int32]) -> float:
    """Standard deviation without the few that a lamp makes; about their median, as all light may differ."""
    off = np.abs(differences - np.median(differences))
    usual = off <= OUTLYING_SD * SD_PER_MAD * (np.median(off) + 0.5)  # whole numbers: the median is as coarse
    return float(np.std(differences[usual]))
