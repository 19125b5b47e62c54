"""Photon-transfer slope from the residuals of a fit, compiled: see `noise.photon_transfer_slope`."""

from __future__ import annotations

from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.compiled import compiled

_SLOPE_ROUNDS: Final = 2
# Ratio to the lowest slope above which a window is not pooled: a misfit only raises the slope.
_MAX_SLOPE_RATIO: Final = 3.0
# Bounds of the slope relative to the assumed one: full wells of 300 to 3e5 electrons. A misfit, or a few
# pixels by chance, would lead beyond.
_SLOPE_SPAN: Final = 30.0
# Weight of the assumed slope against the measured residuals, in pixels.
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
    """Weighted moments of a window: sum of w^2 (1 - h) m^2, and of w^2 m (r^2 - V0 (1 - h)); docs/spots.md.

    The weights w follow from `slope`; where it is 0 they are those of `weight`.
    """
    information = excess = 0.0
    for y in range(signal.shape[0]):
        for x in range(signal.shape[1]):
            w, s, r = weight[y, x], max(signal[y, x], 0.0), residual[y, x]
            kept = max(1.0 - leverage[y, x] * w, 0.0)
            if slope > 0.0:
                w = 1.0 / (floor + slope * s) if w > 0.0 else 0.0
            information += w * w * kept * s * s
            excess += w * w * s * (r * r - floor * kept)
    return information, excess


@compiled
def _are_consistent(information: FloatArray, excess: FloatArray) -> BoolArray:
    """(n,) windows that agree on the slope; each of the others is far above, and measures its own slope only.

    In a window without a spot, or with two, the misfit counts as noise; it must not enter the pooled slope.
    """
    own = excess / np.maximum(information, 1e-30)
    margin = 2.0 * np.sqrt(2.0 / np.maximum(information, 1e-30))
    consistent: BoolArray = own <= _MAX_SLOPE_RATIO * (own + margin).min() + margin
    return consistent


@compiled
def _pooled(information: float, excess: float, slope: float, assumed: float) -> float:
    """Slope from the moments of a pool; `slope` is that of their weights."""
    measured = excess / max(information, 1e-30)
    pixels = information * slope**2
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
    information, excess, slope = np.empty(n), np.empty(n), assumed.copy()
    for i in range(n):
        information[i], excess[i] = _slope_sums(signal[i], residual[i], weight[i], leverage[i], floor[i], 0.0)
    consistent = _are_consistent(information, excess)
    if n == 1:
        consistent[:] = True
    pooled = 0.0
    for turn in range(_SLOPE_ROUNDS + 1):
        first = -1
        for i in range(n):
            if consistent[i] and first < 0:
                first = i
        if first >= 0:
            pooled = _pooled(
                information[consistent].sum(), excess[consistent].sum(), slope[first], assumed[0]
            )
        for i in range(n):
            slope[i] = pooled if consistent[i] else _pooled(information[i], excess[i], slope[i], assumed[0])
            if turn < _SLOPE_ROUNDS:
                information[i], excess[i] = _slope_sums(
                    signal[i], residual[i], weight[i], leverage[i], floor[i], slope[i]
                )
    return slope
