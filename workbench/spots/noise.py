"""Pixel noise measured from the frame: floor from the background, slope from the residuals of the fits."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.arrays import Float32Array, FloatArray
from workbench.spots.kernels.photon_transfer import transfer_slope
from workbench.spots.kernels.strip_pixels import level_of

_SAMPLES = 1200
_CLIP_SD = 4.0
# Variance of rounding to whole numbers.
ROUNDING_DN2 = 1.0 / 12.0


@dataclass(frozen=True, slots=True)
class PixelNoise:
    """Variance of a pixel as a straight line over its expected signal (photon transfer)."""

    floor_dn2: FloatArray
    """(n,) variance without signal, DN^2, for each window."""
    slope_dn: FloatArray
    """(n,) variance per signal, DN^2 / DN."""


def level_and_variance(values: Float32Array) -> tuple[float, float]:
    """Robust mean and variance of pixels, a few of which belong to spots.

    Quantiles first, which are robust against the spots; then mean and variance of the pixels within 4 sd,
    which are efficient and unaffected by rounding.
    """
    return level_of(values, _SAMPLES, _CLIP_SD, ROUNDING_DN2)


def photon_transfer_slope(
    signal: FloatArray, residual: FloatArray, weight: FloatArray, leverage: FloatArray, noise: PixelNoise
) -> FloatArray:
    """(n,) variance per signal (DN) measured from the residuals of all spots of a frame.

    The expected squared residual is V (1 - h), with V = floor + slope * signal and h the leverage. Weighted
    moments give the slope. It is averaged, in the logarithm, with the assumed one, which has the weight of
    a quarter of a pixel. The inverse of a slope from n pixels is biased upwards, and standard deviations
    would be too small on average (Student, factor n / (n - 2)). As the assumed slope bounds the measured
    one, the factor at n + 4 suffices.

    Args:
        signal: (n, height, width) expected signal, DN.
        residual: (n, height, width), DN.
        weight: (n, height, width) inverse variance, 0 where unused.
        leverage: (n, height, width) variance of the fitted value, DN^2.
        noise: Floor, and the assumed slope.
    """
    return transfer_slope(signal, residual, weight, leverage, noise.floor_dn2, noise.slope_dn)
