"""Pixel noise measured from the frame: floor from the background, the rest from the residuals of the fits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from workbench.model.arrays import Float32Array, FloatArray
from workbench.spots.kernels.photon_transfer import shared_grains
from workbench.spots.kernels.strip_pixels import level_of

_SAMPLES = 1200
_CLIP_SD = 4.0
_INVERSION_STEPS = 30
# Variance of rounding to whole numbers.
ROUNDING_DN2 = 1.0 / 12.0


@dataclass(frozen=True, slots=True)
class PixelNoise:
    """Variance of a pixel in n windows: read noise and ambient light, shot noise, speckle (docs/spots.md)."""

    floor_dn2: FloatArray
    """(n,) variance without signal, DN^2."""
    slope_dn: FloatArray
    """(n,) variance per signal (photon transfer), DN^2 / DN."""
    contrast2: FloatArray
    """(n,) squared contrast of speckle in an evenly lit pixel."""
    stated_contrast2: float = 0.0
    """The same as stated, which a measurement is averaged with; 0: not known."""

    def copy(self) -> PixelNoise:
        """The same with arrays of slope and contrast of its own, which a fit replaces."""
        return replace(self, slope_dn=self.slope_dn.copy(), contrast2=self.contrast2.copy())


def level_and_variance(values: Float32Array) -> tuple[float, float]:
    """Robust mean and variance of pixels, a few of which belong to spots.

    Quantiles first, which are robust against the spots; then mean and variance of the pixels within 4 sd,
    which are efficient and unaffected by rounding.
    """
    return level_of(values, _SAMPLES, _CLIP_SD, ROUNDING_DN2)


def stated_contrast2(speckle_sd_px: float) -> float:
    """Squared contrast of speckle in a pixel, from the deviation of a centre that it causes.

    That of a centroid is sqrt(a / 8 pi) for any width, where a = c^2 (1 + 1.3 c) is the area of a grain in
    pixels. The maximum-likelihood centre is better where the spot is bright, and worse where it is dim.
    """
    area = 8.0 * math.pi * speckle_sd_px**2
    contrast2 = area
    for _ in range(_INVERSION_STEPS):  # each divides the error by four or more
        contrast2 = area / shared_grains(contrast2)
    return contrast2
