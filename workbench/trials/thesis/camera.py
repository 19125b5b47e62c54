"""Frames of the thesis's scene as a camera takes them: light is integrated over pixels, after a lens.

The thesis takes a spot's intensity at the middle of each pixel. From half a metre on its spots are then
narrower than any lens makes them, and a spot's place between two pixels is hardly told. Here the same beams
fall through a lens that blurs, on pixels with an area; the flux of a spot falls with the square of its
distance. The lens and the noise are those of the virtual bench's camera.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import norm_cdf
from workbench.trials.thesis.scene import Line

Frame = NDArray[np.uint8]
BAND_PX = 64
"""Rows (columns) about the line that a frame has: nothing else is lit."""
BLUR_PX = 0.7
"""Standard deviation of the lens's Gaussian point spread."""
FULL_WELL_E = 40_000.0
READ_NOISE_E = 225.0
BLACK_LEVEL = 0.03
METERED_PEAK = 0.7
"""Of full scale, both: where no light is, and where the brightest pixel is when every laser is lit."""
FULL_SCALE_DN = 255


def expose(
    line: Line, depths_mm: FloatArray, spots_px: FloatArray, lit: BoolArray, noise: Generator | None
) -> tuple[Frame, Frame]:
    """A frame with the lasers `lit` and one with none; (BAND_PX, length), or turned for a vertical line.

    Exposure is metered with every laser lit, so that a spot alone is as bright as among the others.

    Args:
        line: the lasers.
        depths_mm: (n,) where their beams end.
        spots_px: (n,) where the spots appear along the line.
        lit: (n,) whose spots are to be seen.
        noise: draws shot and read noise; None for frames without, rounded to whole numbers alone.
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
    """Share of a spot's light in a pixel at its centre."""
    return np.asarray((2 * norm_cdf(0.5 / width_px) - 1) ** 2)


def _profile(centre_px: float, width_px: float, pixels: int) -> FloatArray:
    """(pixels,) share of a Gaussian's light in each pixel of a row."""
    return np.diff(norm_cdf((np.arange(pixels + 1) - 0.5 - centre_px) / width_px))


def _digitise(light: FloatArray, noise: Generator | None) -> Frame:
    electrons = light
    if noise is not None:
        deviation = np.sqrt(light + READ_NOISE_E**2)
        electrons = light + deviation * noise.standard_normal(light.shape, np.float32)
    number = np.rint(FULL_SCALE_DN * (electrons / FULL_WELL_E + BLACK_LEVEL))
    return np.clip(number, 0, FULL_SCALE_DN).astype(np.uint8)
