"""Compiled loops around the fit: peaks of a strip, windows cut out of the frames, first guesses."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from workbench.spots.compiled import compiled
from workbench.spots.types import Bools, Floats, Image

Floats32 = NDArray[np.float32]
Ints = NDArray[np.intp]
_MAX_PEAKS: Final = 64
# Peaks nearer than this are one unless a valley lies between them, this deep in sd and as a share of the
# lower.
_NEAR_PX: Final = 16
_VALLEY_SD: Final = 3.0
_VALLEY_SHARE: Final = 0.08
_BINS: Final = 2000
_PER_HALF_HEIGHT: Final = 1.0 / (2.0 * math.pi * math.log(2.0))


@compiled
def _is_top(image: Floats32, row: int, col: int) -> bool:
    """Whether no neighbour is higher."""
    for y in range(max(row - 1, 0), min(row + 2, image.shape[0])):
        for x in range(max(col - 1, 0), min(col + 2, image.shape[1])):
            if image[y, x] > image[row, col]:
                return False
    return True


@compiled
def _lowest_between(image: Floats32, row: int, col: int, dv: int, du: int) -> float:
    """Lowest pixel on the way from (row, col) to (row + dv, col + du)."""
    steps = 2 * max(abs(du), abs(dv))
    lowest = math.inf
    for step in range(steps + 1):
        share = step / max(steps, 1)
        y, x = int(np.rint(row + share * dv)), int(np.rint(col + share * du))
        lowest = min(lowest, np.float64(image[y, x]))
    return lowest


@compiled
def _is_ripple(image: Floats32, top: Ints, tops: Ints, sd: float) -> bool:
    """Whether no valley parts a peak (2,) from one of the higher `tops` (n, 2): noise, a clipped plateau."""
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
def tops_of(image: Floats32, mask: Bools, threshold: float, sd: float) -> Ints:
    """(n, 2) rows and columns of local maxima above `threshold`, highest first, ripples left out.

    Args:
        image: The smoothed strip, DN.
        mask: (height, width) where maxima count; of any other shape: everywhere.
        threshold: DN.
        sd: Of the smoothed noise, DN.
    """
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
def _quantiles(sample: Floats32, shares: tuple[float, float, float]) -> tuple[float, float, float]:
    """Quantiles, to half a bin: 1 DN, which is exact for whole numbers, or a 2000th of the range."""
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
def level_of(values: Floats32, samples: int, clip_sd: float, least_variance: float) -> tuple[float, float]:
    """Robust mean and variance: see `noise.level_and_variance`."""
    sample = values.ravel()[:: max(1, values.size // samples)].copy()
    low, middle, high = _quantiles(sample, (0.1587, 0.5, 0.8413))
    # Half the distance between the quantiles of +-1 sd; the lower half alone when spots fill the upper one.
    reach = clip_sd * max(min(middle - low, 0.5 * (high - low)), 0.5)
    total = square = 0.0
    count = 0
    for i in range(sample.size):
        d = np.float64(sample[i]) - middle
        inside = 1.0 if abs(d) <= reach else 0.0
        count += int(inside)
        total += d * inside
        square += d * d * inside
    if count == 0:
        return middle, least_variance
    mean = total / count
    return middle + mean, max(square / count - mean**2, least_variance)


@compiled
def smoothed(signal: Floats32, taps: Floats32) -> Floats32:
    """A strip after a separable filter with an odd number of taps; beyond the rim its last pixels repeat."""
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
def cut(
    on: Image, off: Image, share: float, level: float, clip_dn: float, rows: Ints, cols: Ints, half: int
) -> tuple[Floats, Bools, Floats]:
    """Data, usable pixels and clipping values of square windows, as in `Windows`."""
    n, side = len(rows), 2 * half + 1
    data, clip = np.empty((n, side, side)), np.full((n, side, side), math.inf)
    usable = np.empty((n, side, side), np.bool_)
    clipped = False
    for i in range(n):
        for y in range(side):
            v = rows[i] - half + y
            row = min(max(v, 0), on.shape[0] - 1)
            for x in range(side):
                u = cols[i] - half + x
                col = min(max(u, 0), on.shape[1] - 1)
                raw = float(on[row, col])
                data[i, y, x] = raw - share * float(off[row, col]) - level
                usable[i, y, x] = u == col and v == row and raw < clip_dn
                clipped = clipped or raw >= clip_dn
    if clipped:
        for i in range(n):
            for y in range(side):
                row = min(max(rows[i] - half + y, 0), on.shape[0] - 1)
                for x in range(side):
                    col = min(max(cols[i] - half + x, 0), on.shape[1] - 1)
                    clip[i, y, x] = data[i, y, x] + (clip_dn - float(on[row, col]))
    return data, usable, clip


@compiled
def part(usable: Bools, rows: Ints, cols: Ints, group: Ints) -> None:
    """Make the pixels unusable that lie nearer to another peak than to the window's own."""
    half = usable.shape[1] // 2
    for i in range(len(group)):
        for k in range(len(rows)):
            dv, du = rows[k] - rows[group[i]], cols[k] - cols[group[i]]
            square = dv * dv + du * du
            if square == 0 or square > (2 * half) ** 2:
                continue
            for y in range(usable.shape[1]):
                for x in range(usable.shape[2]):
                    if 2 * ((y - half) * dv + (x - half) * du) > square:
                        usable[i, y, x] = False


@compiled
def guess(data: Floats, usable: Bools) -> Floats:
    """(n, 6) start: width from the number of pixels above half the peak (2 pi ln 2 widths squared)."""
    start = np.zeros((len(data), 6))
    for i in range(len(data)):
        height = -math.inf
        for y in range(data.shape[1]):
            for x in range(data.shape[2]):
                height = max(height, data[i, y, x] if usable[i, y, x] else 0.0)
        mass = of_u = of_v = 0.0
        count = 0
        for y in range(data.shape[1]):
            for x in range(data.shape[2]):
                above = (data[i, y, x] if usable[i, y, x] else 0.0) - 0.5 * height
                if above > 0.0:
                    count += 1
                    mass, of_u, of_v = mass + above, of_u + above * x, of_v + above * y
        square = count * _PER_HALF_HEIGHT
        start[i, 1] = height * (2.0 * math.pi) * (square + 0.08)
        start[i, 2], start[i, 3] = of_u / max(mass, 1e-9), of_v / max(mass, 1e-9)
        start[i, 4] = start[i, 5] = 0.5 * math.log(max(square, 0.1))
    return start


@compiled
def is_clipped(on: Image, clip_dn: float, params: Floats) -> Bools:
    """(n,) whether a pixel within two widths of a spot (n, 6 or 7, in pixels of the image) is clipped."""
    clipped = np.zeros(len(params), np.bool_)
    for i in range(len(params)):
        u, v, reach_u, reach_v = (
            params[i, 2],
            params[i, 3],
            2 * math.exp(params[i, 4]),
            2 * math.exp(params[i, 5]),
        )
        first_row, last_row = int(np.rint(v - reach_v)), int(np.rint(v + reach_v))
        first_col, last_col = int(np.rint(u - reach_u)), int(np.rint(u + reach_u))
        for y in range(max(first_row, 0), min(last_row + 1, on.shape[0])):
            for x in range(max(first_col, 0), min(last_col + 1, on.shape[1])):
                clipped[i] = clipped[i] or float(on[y, x]) >= clip_dn
    return clipped
