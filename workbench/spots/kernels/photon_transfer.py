"""Photon-transfer slope and speckle contrast from the residuals of a fit, compiled.

The variance of a pixel is `V = V0 + g m + c^2 q`: m is the expected signal, q the mean square of the light on
the pixel. Weighted moments of the squared residuals give g and c^2. Derivation: docs/spots.md.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.compiled import compiled

_ROUNDS: Final = 2
# Ratio to the lowest variance above which a window is not pooled: a misfit only raises the variance.
_MAX_RATIO: Final = 3.0
# Bounds of the slope relative to the assumed one: full wells of 300 to 3e5 electrons. A misfit, or a few
# pixels by chance, would lead beyond.
_SLOPE_SPAN: Final = 30.0
# Weights of the assumed slope and of a stated contrast, in pixels.
_SLOPE_PRIOR_PIXELS: Final = 0.25
_CONTRAST_PRIOR_PIXELS: Final = 4.0
# Significance, in standard deviations, from which a contrast counts that is not stated.
_SIGNIFICANT_SD: Final = 3.0
# Squared contrast below which there is no speckle.
_LEAST_CONTRAST2: Final = 1e-8
# Share of a pixel's grains on its border, over the contrast.
_GRAIN_OVERLAP: Final = 1.3
# Columns of the moments.
_BY_SLOPE, _MIXED, _BY_CONTRAST, _SLOPE_EXCESS, _CONTRAST_EXCESS = range(5)
_MOMENTS: Final = 5


@compiled
def shared_grains(contrast2: float) -> float:
    """Variance by speckle of a smooth sum over pixels, over that of pixels with independent speckle.

    A grain on the border of two pixels lights both. Fully developed speckle of contrast c has grains of the
    area c^2 px^2; docs/spots.md.
    """
    return 1.0 + _GRAIN_OVERLAP * math.sqrt(min(contrast2, 1.0))


@compiled
def _fill_moments(
    signal: FloatArray,
    mean_square: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    leverage: FloatArray,
    floor: float,
    slope: float,
    contrast2: float,
    out: FloatArray,
) -> None:
    """Fill (_MOMENTS,) of a window: sums of w^2 (1 - h) times m^2, m q, q^2; of w^2 y times m, q.

    h is the leverage, y = r^2 - V0 (1 - h), and w the inverse variance for `slope` and `contrast2`.
    """
    slope2 = mixed = contrast4 = by_slope = by_contrast = 0.0
    for y in range(signal.shape[0]):
        for x in range(signal.shape[1]):
            if weight[y, x] > 0.0:
                m, q, r = max(signal[y, x], 0.0), mean_square[y, x], residual[y, x]
                kept = max(1.0 - leverage[y, x] * weight[y, x], 0.0)
                w = 1.0 / (floor + slope * m + contrast2 * q)
                excess = w * w * (r * r - floor * kept)
                kept *= w * w
                slope2 += kept * m * m
                mixed += kept * m * q
                contrast4 += kept * q * q
                by_slope += excess * m
                by_contrast += excess * q
    out[_BY_SLOPE], out[_MIXED], out[_BY_CONTRAST] = slope2, mixed, contrast4
    out[_SLOPE_EXCESS], out[_CONTRAST_EXCESS] = by_slope, by_contrast


@compiled
def _agree(information: FloatArray, excess: FloatArray) -> BoolArray:
    """(n,) windows that agree on one term of the variance; each of the others is far above."""
    own = excess / np.maximum(information, 1e-30)
    margin = 2.0 * np.sqrt(2.0 / np.maximum(information, 1e-30))
    agreeing: BoolArray = own <= _MAX_RATIO * (own + margin).min() + margin
    return agreeing


@compiled
def _peaks_inside(signal: FloatArray) -> bool:
    """Whether the highest pixel of a window is lit and not at its border."""
    height, width = signal.shape
    inside = at_border = 0.0
    for y in range(height):
        for x in range(width):
            if y == 0 or y == height - 1 or x == 0 or x == width - 1:
                at_border = max(at_border, signal[y, x])
            else:
                inside = max(inside, signal[y, x])
    return inside > at_border


@compiled
def _consistent(moments: FloatArray, signal: FloatArray) -> BoolArray:
    """(n,) windows that hold a spot, and agree on the slope or on the contrast.

    In a window without a spot, or with two, the misfit counts as noise, and raises both; it must not enter
    the pooled values.
    """
    consistent = np.array([_peaks_inside(one) for one in signal])
    if consistent.sum() > 1:
        own = moments[consistent]
        by_slope = _agree(own[:, _BY_SLOPE], own[:, _SLOPE_EXCESS])
        by_contrast = _agree(own[:, _BY_CONTRAST], own[:, _CONTRAST_EXCESS])
        consistent[consistent] = by_slope | by_contrast
    return consistent


@compiled
def _blended_slope(measured: float, assumed: float, pixels: float) -> float:
    """Slope measured from some pixels, averaged in the logarithm with the assumed one."""
    share = _SLOPE_PRIOR_PIXELS / (pixels + _SLOPE_PRIOR_PIXELS)
    within = min(max(measured, assumed / _SLOPE_SPAN), assumed * _SLOPE_SPAN)
    slope: float = assumed**share * within ** (1.0 - share)
    return slope


@compiled
def _solved(
    moments: FloatArray, slope: float, contrast2: float, assumed_slope: float, stated_contrast2: float
) -> tuple[float, float]:
    """Slope and squared contrast from the moments of a pool, which were taken at `slope` and `contrast2`.

    First the contrast with the slope free, then the slope, then the contrast with that slope.
    """
    by_slope, mixed = max(moments[_BY_SLOPE], 1e-30), moments[_MIXED]
    by_contrast, of_contrast = max(moments[_BY_CONTRAST], 1e-30), moments[_CONTRAST_EXCESS]
    if stated_contrast2 > 0.0 and contrast2 > _LEAST_CONTRAST2:
        prior = _CONTRAST_PRIOR_PIXELS / (contrast2 * contrast2)
        by_contrast, of_contrast = by_contrast + prior, of_contrast + prior * stated_contrast2
    # The variance of the squared contrast is 2 / information.
    information = max(by_contrast - mixed * mixed / by_slope, 1e-30)
    free = (of_contrast - mixed * moments[_SLOPE_EXCESS] / by_slope) / information
    least = 0.0 if stated_contrast2 > 0.0 else _SIGNIFICANT_SD * math.sqrt(2.0 / information)
    speckled = free > least
    measured = (moments[_SLOPE_EXCESS] - (mixed * free if speckled else 0.0)) / by_slope
    new_slope = _blended_slope(measured, assumed_slope, by_slope * slope * slope)
    new_contrast2 = (of_contrast - mixed * new_slope) / by_contrast
    return new_slope, new_contrast2 if speckled and new_contrast2 > 0.0 else 0.0


@compiled
def _student(moments: FloatArray, at: tuple[float, float], stated_contrast2: float) -> float:
    """Factor on slope and contrast measured from few pixels.

    The inverse of a variance from n pixels is biased upwards, and standard deviations would be too small on
    average (Student, factor n / (n - 2)). With a stated contrast the variance scatters less.

    Args:
        moments: Of the pool.
        at: Slope and squared contrast that they were taken at.
        stated_contrast2: Zero where it is not known.
    """
    slope, contrast2 = at
    pixels = (
        slope * slope * moments[_BY_SLOPE]
        + 2.0 * slope * contrast2 * moments[_MIXED]
        + contrast2 * contrast2 * moments[_BY_CONTRAST]
    )
    factor: float = 1.0 if stated_contrast2 > 0.0 else 1.0 + 2.0 / max(pixels + 2.0, 8.0)
    return factor


@compiled
def measure_variance(
    signal: FloatArray,
    mean_square: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    leverage: FloatArray,
    floor: FloatArray,
    slope: FloatArray,
    contrast2: FloatArray,
    stated_contrast2: float,
) -> None:
    """Replace the assumed `slope` and `contrast2` (n,) by those of the residuals of all spots of a frame.

    The expected squared residual is V (1 - h), with V = floor + slope * signal + contrast2 * mean_square and
    h the leverage. Weighted moments give slope and contrast. The assumed slope counts as a quarter of a
    pixel, in the logarithm; a stated contrast as four. One that is not stated counts where it is significant.

    Args:
        signal: (n, height, width) expected signal, DN.
        mean_square: (n, height, width) mean square of the light on a pixel, DN^2.
        residual: (n, height, width), DN.
        weight: (n, height, width) inverse variance, 0 where unused.
        leverage: (n, height, width) variance of the fitted value, DN^2.
        floor: (n,) variance without signal, DN^2.
        slope: (n,) as assumed, changed.
        contrast2: (n,) first guess, changed.
        stated_contrast2: as stated; 0: not known.
    """
    n = len(signal)
    assumed_slope = slope.copy()
    moments, pool, consistent = np.empty((n, _MOMENTS)), np.zeros(_MOMENTS), np.ones(n, np.bool_)
    for turn in range(_ROUNDS + 1):
        for i in range(n):
            _fill_moments(
                signal[i],
                mean_square[i],
                residual[i],
                weight[i],
                leverage[i],
                floor[i],
                slope[i],
                contrast2[i],
                moments[i],
            )
        if turn == 0:
            consistent = _consistent(moments, signal)
        pool[:] = 0.0
        for i in range(n):
            if consistent[i]:
                pool += moments[i]
        for i in range(n):
            own = pool if consistent[i] else moments[i]
            before = slope[i], contrast2[i]
            slope[i], contrast2[i] = _solved(own, slope[i], contrast2[i], assumed_slope[i], stated_contrast2)
            if turn == _ROUNDS:
                factor = _student(own, before, stated_contrast2)
                slope[i], contrast2[i] = factor * slope[i], factor * contrast2[i]
