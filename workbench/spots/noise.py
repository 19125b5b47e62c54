"""Noise measured from the frame itself: the floor from its background, the slope from the residuals of the fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.spots.types import Floats

_SAMPLES = 1200
_CLIP_SD = 4.0
# Variance that rounding to whole numbers alone leaves in a frame.
ROUNDING_DN2 = 1.0 / 12.0
_SLOPE_ROUNDS = 3
# Windows whose slope is more than this many times the median's are left to themselves.
_ALIKE = 3.0
# Full wells of 3e5 and 300 electrons bound every camera; a misfit, or a few lucky pixels, can look beyond.
_SLOPE_SPAN = 30.0
# The slope assumed so far weighs like this many pixels against the measured residuals.
_PRIOR_PIXELS = 0.25


@dataclass(frozen=True, slots=True)
class Noise:
    """Variance of a pixel as a straight line over its expected signal (photon transfer)."""

    floor_dn2: Floats
    """(n, 1, 1), one for each window: variance without signal, DN^2."""
    slope_dn: Floats
    """(n, 1, 1): variance per signal, DN^2 / DN."""


def level_and_variance(values: NDArray[np.float32]) -> tuple[float, float]:
    """Robust mean and variance of pixels among which a few are spots.

    Quantiles first, then mean and variance of what lies within 4 sd of them: the former resist the spots, the
    latter are efficient and free of the rounding to whole numbers.
    """
    flat = values.reshape(-1)
    sample = np.sort(flat[:: max(1, flat.size // _SAMPLES)])
    n = sample.size
    middle = float(sample[n // 2])
    # Half the distance between the quantiles of +-1 sd; the lower half alone when spots fill the upper one.
    lower = middle - float(sample[int(0.1587 * n)])
    reach = _CLIP_SD * max(min(lower, 0.5 * (float(sample[int(0.8413 * n)]) - middle + lower)), 0.5)
    first, last = np.searchsorted(sample, (middle - reach, middle + reach))
    kept = sample[first:last] - np.float32(middle)
    if kept.size == 0:
        return middle, ROUNDING_DN2
    mean = float(kept.sum()) / kept.size
    return middle + mean, max(float(kept @ kept) / kept.size - mean**2, ROUNDING_DN2)


def photon_transfer_slope(
    signal: Floats, residual: Floats, weight: Floats, leverage: Floats, noise: Noise
) -> Floats:
    """(n, 1, 1) variance per signal (DN) measured from the residuals of all spots of a frame.

    On average a squared residual is its variance less the share that the fit has absorbed (its leverage), so
    what exceeds the floor is slope times signal. Weighted moments give the slope; the logarithm of the slope
    assumed so far weighs in like a quarter of a pixel. Where only n pixels tell the slope, its inverse scatters
    upwards and a deviation stated with it would be too small on average (Student's distribution, factor
    n / (n - 2)); as the assumed slope keeps the measured one from vanishing, n / (n - 2) at n + 4 is enough.

    Args:
        signal: (n, height, width) expected signal, DN.
        residual: (n, height, width), DN.
        weight: (n, height, width) inverse variance, 0 where unused.
        leverage: (n, height, width) variance of the fitted value, DN^2.
        noise: Floor, and the slope assumed so far.
    """
    signal = np.maximum(signal, 0.0)
    kept = np.maximum(1.0 - leverage * weight, 0.0)
    kept *= signal
    excess = residual * residual
    excess *= signal
    excess -= noise.floor_dn2 * kept
    kept *= signal
    slope, square = noise.slope_dn, weight * weight
    for _ in range(_SLOPE_ROUNDS):
        told = np.add.reduce(square * kept, (1, 2))
        excesses = np.add.reduce(square * excess, (1, 2))
        slope = _agreed(told, excesses, slope, noise.slope_dn)
        square = noise.floor_dn2 + slope * signal
        square *= square
        np.divide(weight > 0, square, out=square)
    return slope


def _agreed(told: Floats, excess: Floats, slope: Floats, assumed: Floats) -> Floats:
    """(n, 1, 1) slope of each window: that of all windows which agree, its own where it is far above them.

    A window that holds no spot, or two, looks as if its light were noisier; it must not speak for the others.
    """
    own = excess / np.maximum(told, 1e-30)
    alike = own <= np.sort(own)[(len(own) - 1) // 2] * _ALIKE + 4.0 * np.sqrt(2.0 / np.maximum(told, 1e-30))
    sums = np.where(alike, told @ alike, told), np.where(alike, excess @ alike, excess)
    pixels = sums[0] * slope[:, 0, 0] ** 2
    assumed = assumed[:, 0, 0]
    measured = np.clip(sums[1] / np.maximum(sums[0], 1e-30), assumed / _SLOPE_SPAN, assumed * _SLOPE_SPAN)
    share = _PRIOR_PIXELS / (pixels + _PRIOR_PIXELS)
    agreed: Floats = assumed**share * measured ** (1.0 - share)
    agreed *= 1.0 + 2.0 / np.maximum(pixels + 2.0, 8.0)
    return agreed[:, None, None]
