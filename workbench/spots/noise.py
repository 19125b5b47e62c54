"""Noise measured from the frame itself: its floor from the background, its slope from the fit's residuals."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.arrays import Float32Array, FloatArray
from workbench.spots.kernels.photon_transfer import transfer_slope
from workbench.spots.kernels.strip_pixels import level_of

_SAMPLES = 1200
_CLIP_SD = 4.0
# Variance that rounding to whole numbers alone leaves in a frame.
ROUNDING_DN2 = 1.0 / 12.0


@dataclass(frozen=True, slots=True)
class PixelNoise:
    """Variance of a pixel as a straight line over its expected signal (photon transfer)."""

    floor_dn2: FloatArray
    """(n,), one for each window: variance without signal, DN^2."""
    slope_dn: FloatArray
    """(n,): variance per signal, DN^2 / DN."""


def level_and_variance(values: Float32Array) -> tuple[float, float]:
    """Robust mean and variance of pixels among which a few are spots.

    Quantiles first, then mean and variance of what lies within 4 sd of them: the former resist the spots, the
    latter are efficient and free of the rounding to whole numbers.
    """
    return level_of(values, _SAMPLES, _CLIP_SD, ROUNDING_DN2)


def photon_transfer_slope(
    signal: FloatArray, residual: FloatArray, weight: FloatArray, leverage: FloatArray, noise: PixelNoise
) -> FloatArray:
    """(n,) variance per signal (DN) measured from the residuals of all spots of a frame.

    On average a squared residual is its variance less the share that the fit has absorbed (its leverage), so
    what exceeds the floor is slope times signal. Weighted moments give the slope; the logarithm of the slope
    assumed so far weighs in like a quarter of a pixel. Where only n pixels tell the slope, its inverse
    scatters upwards and a deviation stated with it would be too small on average (Student's distribution,
    factor n / (n - 2)); as the assumed slope keeps the measured one from vanishing, n / (n - 2) at n + 4 is
    enough.

    Args:
        signal: (n, height, width) expected signal, DN.
        residual: (n, height, width), DN.
        weight: (n, height, width) inverse variance, 0 where unused.
        leverage: (n, height, width) variance of the fitted value, DN^2.
        noise: Floor, and the slope assumed so far.
    """
    return transfer_slope(signal, residual, weight, leverage, noise.floor_dn2, noise.slope_dn)
