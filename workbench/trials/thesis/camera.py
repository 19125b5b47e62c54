"""Frames of the thesis's scenes with a realistic camera: a lens that blurs, and pixels that integrate light.

The thesis evaluates a spot's intensity at the centre of each pixel. Beyond half a metre its spots are then
narrower than any lens produces, and their position between two pixels is almost lost. Here the same beams
pass a lens with a Gaussian point spread and fall on pixels with an area. The flux of a spot decreases with
the square of the distance. Lens and noise are those of the virtual bench's camera.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import norm_cdf
from workbench.trials.thesis.scene import LaserLine

Frame = NDArray[np.uint8]
BAND_PX = 64
"""Rows (columns) of a frame around the line; no other pixels receive light."""
BLUR_PX = 0.7
"""Standard deviation of the lens's Gaussian point spread."""
FULL_WELL_E = 40_000.0
READ_NOISE_E = 225.0
BLACK_LEVEL = 0.03
METERED_PEAK = 0.7
"""Shares of full scale: a dark pixel (`BLACK_LEVEL`), and the brightest one with every laser on."""
FULL_SCALE_DN = 255


def expose(
    line: LaserLine, depths_mm: FloatArray, spots_px: FloatArray, lit: BoolArray, noise: Generator | None
) -> tuple[Frame, Frame]:
    """Frames with the lasers `lit` and with none, (BAND_PX, length), transposed for a vertical line.

    The exposure is metered with every laser on, so that a spot is as bright alone as among the others.

    Args:
        line: line of lasers.
        depths_mm: (n,) depths at which the beams end.
        spots_px: (n,) positions of the spots along the line.
        lit: (n,) lasers whose spots are visible.
        noise: generator of shot and read noise; None for noise-free frames, which are only rounded.
    """
    widths = np.hypot(line.radii_px(depths_mm) / 2, BLUR_PX)
    flux = 1 / depths_mm**2
    flux *= (METERED_PEAK - BLACK_LEVEL) * FULL_WELL_E / (flux * _peak_share(widths)).max()
    light = np.zeros((BAND_PX, line.length_px))
    for spot, width, electrons in zip(spots_px[lit], widths[lit], flux[lit], strict=True):
        across, along = _profile(BAND_PX / 2, width, BAND_PX), _profile(spot, width, line.length_px)
        light += electrons * np.outer(across, along)
    frames = _digitise(light, noise), _digitise(np.zeros_like(light), noise)
    return frames if line.axis == "u" else (frames[0].T.copy(), frames[1].T.copy())


def _peak_share(width_px: FloatArray) -> FloatArray:
    """Share of a spot's light in the pixel at its centre."""
    return np.asarray((2 * norm_cdf(0.5 / width_px) - 1) ** 2)


def _profile(centre_px: float, width_px: float, pixels: int) -> FloatArray:
    """Shares (pixels,) of a Gaussian's light in each pixel of a row."""
    return np.diff(norm_cdf((np.arange(pixels + 1) - 0.5 - centre_px) / width_px))


def _digitise(light: FloatArray, noise: Generator | None) -> Frame:
    electrons = light
    if noise is not None:
        deviation = np.sqrt(light + READ_NOISE_E**2)
        electrons = light + deviation * noise.standard_normal(light.shape, np.float32)
    number = np.rint(FULL_SCALE_DN * (electrons / FULL_WELL_E + BLACK_LEVEL))
    return np.clip(number, 0, FULL_SCALE_DN).astype(np.uint8)
