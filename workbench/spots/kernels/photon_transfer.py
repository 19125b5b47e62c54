"""Photon-transfer slope from the residuals of a fit, compiled: see `noise.photon_transfer_slope`."""

from __future__ import annotations

from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.compiled import compiled

_SLOPE_ROUNDS: Final = 2
# Windows whose slope is surely this many times the lowest are left to themselves: misfits only raise it.
_ALIKE: Final = 3.0
# Full wells of 3e5 and 300 electrons bound every camera; a misfit, or a few lucky pixels, can look beyond.
_SLOPE_SPAN: Final = 30.0
# The slope assumed so far weighs like this many pixels against the measured residuals.
_PRIOR_PIXELS: Final = 0.25


@compiled
def _slope_sums(
    signal: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    leverage: FloatArray,
    floor: float,
    slope: float,
) -> tuple[float, float]:
    """Weighted moments of one window; the weights are those of `weight`, or of `slope` unless it is 0."""
    told = over = 0.0
    for y in range(signal.shape[0]):
        for x in range(signal.shape[1]):
            w, s, r = weight[y, x], max(signal[y, x], 0.0), residual[y, x]
            kept = max(1.0 - leverage[y, x] * w, 0.0)
            if slope > 0.0:
                w = 1.0 / (floor + slope * s) if w > 0.0 else 0.0
            told += w * w * kept * s * s
            over += w * w * s * (r * r - floor * kept)
    return told, over


@compiled
def _agreeing(told: FloatArray, over: FloatArray) -> BoolArray:
    """(n,) which windows agree on the slope; each of the others is far above and left to itself.

    A window that holds no spot, or two, looks as if its light were noisier; it must not speak for the others.
    """
    own = over / np.maximum(told, 1e-30)
    doubt = 2.0 * np.sqrt(2.0 / np.maximum(told, 1e-30))
    alike: BoolArray = own <= _ALIKE * (own + doubt).min() + doubt
    return alike


@compiled
def _pooled(told: float, over: float, slope: float, assumed: float) -> float:
    """Slope from the moments of a pool; `slope` is that of their weights."""
    measured = over / max(told, 1e-30)
    pixels = told * slope**2
    share = _PRIOR_PIXELS / (pixels + _PRIOR_PIXELS)
    within = min(max(measured, assumed / _SLOPE_SPAN), assumed * _SLOPE_SPAN)
    value: float = assumed**share * within ** (1.0 - share)
    value *= 1.0 + 2.0 / max(pixels + 2.0, 8.0)
    return value


@compiled
def transfer_slope(
    signal: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    leverage: FloatArray,
    floor: FloatArray,
    assumed: FloatArray,
) -> FloatArray:
    """See `noise.photon_transfer_slope`."""
    n = len(signal)
    told, over, slope = np.empty(n), np.empty(n), assumed.copy()
    for i in range(n):
        told[i], over[i] = _slope_sums(signal[i], residual[i], weight[i], leverage[i], floor[i], 0.0)
    alike = _agreeing(told, over)
    if n == 1:
        alike[:] = True
    pooled = 0.0
    for turn in range(_SLOPE_ROUNDS + 1):
        first = -1
        for i in range(n):
            if alike[i] and first < 0:
                first = i
        if first >= 0:
            pooled = _pooled(told[alike].sum(), over[alike].sum(), slope[first], assumed[0])
        for i in range(n):
            slope[i] = pooled if alike[i] else _pooled(told[i], over[i], slope[i], assumed[0])
            if turn < _SLOPE_ROUNDS:
                told[i], over[i] = _slope_sums(
                    signal[i], residual[i], weight[i], leverage[i], floor[i], slope[i]
                )
    return slope
