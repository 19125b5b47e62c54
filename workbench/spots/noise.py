"""Noise measured from the frame itself: its floor from the background, its slope from the fit's residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.spots.types import Floats

_SAMPLES = 1200
_CLIP_SD = 4.0
# Variance that rounding to whole numbers alone leaves in a frame.
ROUNDING_DN2 = 1.0 / 12.0
_SLOPE_ROUNDS = 2
# Windows whose slope is surely this many times the lowest are left to themselves: misfits only raise it.
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
    signal = np.maximum(signal, 0.0)
    kept = np.maximum(1.0 - leverage * weight, 0.0)
    kept *= signal
    excess = residual * residual
    excess *= signal
    excess -= noise.floor_dn2 * kept
    kept *= signal
    square = weight * weight
    told, over = np.add.reduce(square * kept, (1, 2)), np.add.reduce(square * excess, (1, 2))
    pools = _agreeing(told, over)
    assumed = float(noise.slope_dn[0, 0, 0])
    slope = noise.slope_dn
    for _ in range(_SLOPE_ROUNDS):
        slope = _pooled(pools, told, over, slope, assumed)
        square = noise.floor_dn2 + slope * signal
        square *= square
        np.divide(weight > 0, square, out=square)
        told, over = np.add.reduce(square * kept, (1, 2)), np.add.reduce(square * excess, (1, 2))
    return _pooled(pools, told, over, slope, assumed)


def _agreeing(told: Floats, over: Floats) -> list[list[int]]:
    """Windows grouped by what they say of the slope: all that agree, and each that is far above by itself.

    A window that holds no spot, or two, looks as if its light were noisier; it must not speak for the others.
    """
    if len(told) == 1:
        return [[0]]
    own = over / np.maximum(told, 1e-30)
    doubt = 2.0 * np.sqrt(2.0 / np.maximum(told, 1e-30))
    limit = _ALIKE * (own + doubt).min() + doubt
    alike = (own <= limit).tolist()
    together = [i for i, same in enumerate(alike) if same]
    alone = [[i] for i, same in enumerate(alike) if not same]
    return [together, *alone] if together else alone


def _pooled(pools: list[list[int]], told: Floats, over: Floats, slope: Floats, assumed: float) -> Floats:
    """(n, 1, 1) slope of each window from the moments of its pool."""
    pooled = np.empty_like(slope)
    tolds, overs = told.tolist(), over.tolist()
    for pool in pools:
        amount = sum(tolds[i] for i in pool)
        measured = sum(overs[i] for i in pool) / max(amount, 1e-30)
        pixels = amount * float(slope[pool[0], 0, 0]) ** 2
        share = _PRIOR_PIXELS / (pixels + _PRIOR_PIXELS)
        within = min(max(measured, assumed / _SLOPE_SPAN), assumed * _SLOPE_SPAN)
        value = assumed**share * within ** (1.0 - share)
        pooled[pool] = value * (1.0 + 2.0 / max(pixels + 2.0, 8.0))
    return pooled
