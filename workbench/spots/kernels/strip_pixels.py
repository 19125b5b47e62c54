"""Compiled loops over a strip of the image: level, noise, and peaks of the smoothed signal."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, Float32Array, FloatArray, IndexArray
from workbench.spots.kernels.compiled import compiled

_MAX_PEAKS: Final = 64
# Peaks closer than this are one, unless the valley between them is this deep: in sd, and as a share of the
# lower peak.
_NEAR_PX: Final = 16
_VALLEY_SD: Final = 3.0
_VALLEY_SHARE: Final = 0.08
_BINS: Final = 2000


@compiled
def _is_top(image: Float32Array, row: int, col: int) -> bool:
    """Whether no neighbour is higher."""
    for y in range(max(row - 1, 0), min(row + 2, image.shape[0])):
        for x in range(max(col - 1, 0), min(col + 2, image.shape[1])):
            if image[y, x] > image[row, col]:
                return False
    return True


@compiled
def _lowest_between(image: Float32Array, row: int, col: int, dv: int, du: int) -> float:
    """Lowest pixel on the straight line from (row, col) to (row + dv, col + du)."""
    steps = 2 * max(abs(du), abs(dv))
    lowest = math.inf
    for step in range(steps + 1):
        share = step / max(steps, 1)
        y, x = int(np.rint(row + share * dv)), int(np.rint(col + share * du))
        lowest = min(lowest, np.float64(image[y, x]))
    return lowest


@compiled
def _is_ripple(image: Float32Array, top: IndexArray, tops: IndexArray, sd: float) -> bool:
    """Whether a peak (2,) has no valley towards a higher one of `tops` (n, 2): noise, a clipped plateau."""
    row, col = top[0], top[1]
    height = np.float64(image[row, col])
    depth = max(_VALLEY_SD * sd, _VALLEY_SHARE * height)
    for k in range(len(tops)):
        dv, du = tops[k, 0] - row, tops[k, 1] - col
        near = abs(du) <= _NEAR_PX and abs(dv) <= _NEAR_PX
        if near and height - _lowest_between(image, row, col, dv, du) < depth:
            return True
    return False


@compiled
def _tops_of(image: Float32Array, mask: BoolArray, threshold: np.float32, sd: float) -> IndexArray:
    """(n, 2) rows and columns of local maxima above `threshold`, highest first, without ripples."""
    everywhere = mask.shape != image.shape
    rows, cols, heights = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]
    for y in range(image.shape[0]):
        above = 0
        for x in range(image.shape[1]):
            above += image[y, x] > threshold
        if above == 0:
            continue
        for x in range(image.shape[1]):
            if image[y, x] > threshold and (everywhere or mask[y, x]) and _is_top(image, y, x):
                rows.append(y)
                cols.append(x)
                heights.append(-np.float64(image[y, x]))
    order = np.argsort(np.array(heights), kind="mergesort")[:_MAX_PEAKS]
    tops = np.empty((len(order), 2), np.intp)
    n = 0
    for i in order:
        tops[n, 0], tops[n, 1] = rows[i], cols[i]
        if not _is_ripple(image, tops[n], tops[:n], sd):
            n += 1
    return tops[:n]


@compiled
def _quantiles(sample: Float32Array, shares: tuple[float, float, float]) -> tuple[float, float, float]:
    """Quantiles from a histogram with bins of 1 DN (exact for whole numbers) or a 2000th of the range."""
    n, first, last = sample.size, np.float64(sample.min()), np.float64(sample.max())
    width = max(1.0, (last - first) / _BINS)
    counts = np.zeros(int((last - first) / width) + 2, np.intp)
    for i in range(n):
        counts[int((np.float64(sample[i]) - first) / width + 0.5)] += 1
    found = np.empty(3)
    below, bin_ = 0, -1
    for q in range(3):
        rank = int(shares[q] * n)
        while below <= rank:
            bin_ += 1
            below += counts[bin_]
        found[q] = first + bin_ * width
    return found[0], found[1], found[2]


@compiled
def _stride(width: int, wanted: int) -> int:
    """Smallest stride from `wanted` on that is coprime to the width: the samples cover every column."""
    while math.gcd(width, wanted) > 1:
        wanted += 1
    return wanted


@compiled
def level_of(
    values: Float32Array, samples: int, clip_sd: float, least_variance: float
) -> tuple[float, float]:
    """Robust mean and variance: see `noise.level_and_variance`."""
    sample = values.ravel()[:: _stride(values.shape[1], max(1, values.size // samples))].copy()
    low, median, high = _quantiles(sample, (0.1587, 0.5, 0.8413))
    # Half the distance between the quantiles of +-1 sd; the lower half alone when spots fill the upper one.
    reach = clip_sd * max(min(median - low, 0.5 * (high - low)), 0.5)
    total = square = 0.0
    count = 0
    for i in range(sample.size):
        d = np.float64(sample[i]) - median
        inside = 1.0 if abs(d) <= reach else 0.0
        count += int(inside)
        total += d * inside
        square += d * d * inside
    if count == 0:
        return median, least_variance
    mean = total / count
    return median + mean, max(square / count - mean**2, least_variance)


@compiled
def _smoothed(signal: Float32Array, taps: Float32Array) -> Float32Array:
    """Strip filtered by a separable filter with an odd number of taps; edge pixels are repeated outwards."""
    height, width = signal.shape
    half = taps.size // 2
    out, row = np.empty_like(signal), np.empty(width + 2 * half, np.float32)
    for y in range(height):
        row[:] = np.float32(0.0)
        for t in range(taps.size):
            source = signal[min(max(y + t - half, 0), height - 1)]
            for x in range(width):
                row[x + half] += taps[t] * source[x]
        row[:half] = row[half]
        row[width + half :] = row[width + half - 1]
        target = out[y]
        target[:] = np.float32(0.0)
        for t in range(taps.size):
            tap = taps[t]
            for x in range(width):
                target[x] += tap * row[x + t]
    return out


@compiled
def peaks_of(
    signal: Float32Array,
    taps: Float32Array,
    mask: BoolArray,
    threshold: float,
    sd: float,
    row0: int,
    col0: int,
) -> FloatArray:
    """(n, 3) row, column and smoothed height (DN) of local maxima, highest first, without ripples.

    Args:
        signal: (height, width) signal of the strip, DN.
        taps: (n,) weights of the smoothing filter.
        mask: (height, width) pixels where maxima count; of any other shape: all.
        threshold: Least height of the smoothed signal, DN.
        sd: Standard deviation of the smoothed noise, DN.
        row0: The strip's first row.
        col0: The strip's first column.
    """
    image = _smoothed(signal, taps)
    tops = _tops_of(image, mask, np.float32(threshold), sd)
    peaks = np.empty((len(tops), 3))
    for i in range(len(tops)):
        peaks[i, 0], peaks[i, 1] = row0 + tops[i, 0], col0 + tops[i, 1]
        peaks[i, 2] = np.float64(image[tops[i, 0], tops[i, 1]])
    return peaks
