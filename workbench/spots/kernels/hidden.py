"""Matched filter of the residuals of a joint fit, compiled: where a further spot is most significant."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.compiled import compiled

# Length of a filter on either side, in widths.
_FILTER_WIDTHS: Final = 4.0
_LEAST_INFORMATION: Final = 1e-12


@compiled
def _gaussian(width_px: float) -> FloatArray:
    """(n,) weights of a sampled Gaussian with the sum 1, n odd."""
    half = round(2.0 * _FILTER_WIDTHS * width_px + 1.0) // 2
    taps = np.empty(2 * half + 1)
    for i in range(taps.size):
        taps[i] = math.exp(-0.5 * ((i - half) / width_px) ** 2)
    taps /= taps.sum()
    return taps


@compiled
def smoothed(image: FloatArray, width_u_px: float, width_v_px: float) -> FloatArray:
    """(height, width) image filtered by a Gaussian, zeros outside."""
    height, width = image.shape
    along_u, along_v = _gaussian(width_u_px), _gaussian(width_v_px)
    half_u, half_v = along_u.size // 2, along_v.size // 2
    row, out = np.empty(width), np.zeros((height, width))
    for y in range(height):
        row[:] = 0.0
        for source in range(max(y - half_v, 0), min(y + half_v + 1, height)):
            tap = along_v[source - y + half_v]
            for x in range(width):
                row[x] += tap * image[source, x]
        for t in range(along_u.size):
            shift, tap = t - half_u, along_u[t]
            for x in range(max(-shift, 0), min(width - shift, width)):
                out[y, x] += tap * row[x + shift]
    return out


@compiled
def _without_hot_pixels(residual: FloatArray, weight: FloatArray) -> FloatArray:
    """(height, width) weighted residuals, each limited to the highest of its neighbours."""
    height, width = residual.shape
    out = np.empty((height, width))
    for y in range(height):
        for x in range(width):
            highest = -math.inf
            for near_y in range(max(y - 1, 0), min(y + 2, height)):
                for near_x in range(max(x - 1, 0), min(x + 2, width)):
                    if near_y != y or near_x != x:
                        highest = max(highest, residual[near_y, near_x])
            out[y, x] = weight[y, x] * min(residual[y, x], highest)
    return out


@compiled
def most_significant(
    residual: FloatArray, weight: FloatArray, allowed: BoolArray, width_u_px: float, width_v_px: float
) -> tuple[float, int, int, float]:
    """Height in standard deviations, row, column, and flux of the most significant further spot.

    Args:
        residual: (height, width) of the fit, DN.
        weight: (height, width) inverse variance, 0 where unused.
        allowed: (height, width) pixels where a spot may lie; the height is 0 elsewhere.
        width_u_px: Width of a spot along u.
        width_v_px: Width of a spot along v.
    """
    matched = smoothed(_without_hot_pixels(residual, weight), width_u_px, width_v_px)
    # The square of a Gaussian is a Gaussian narrower by sqrt(2), with the sum 1 / (4 pi su sv).
    information = smoothed(weight, width_u_px / math.sqrt(2.0), width_v_px / math.sqrt(2.0))
    scale = 1.0 / (4.0 * math.pi * width_u_px * width_v_px)
    best, row, col, flux = -math.inf, 0, 0, 0.0
    for y in range(residual.shape[0]):
        for x in range(residual.shape[1]):
            known = max(information[y, x] * scale, _LEAST_INFORMATION)
            height = matched[y, x] / math.sqrt(known) if allowed[y, x] else 0.0
            if height > best:
                best, row, col, flux = height, y, x, matched[y, x] / known
    return best, row, col, flux
