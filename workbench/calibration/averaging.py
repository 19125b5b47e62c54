"""Averaging repeated readings of one spot, coordinate by coordinate. Average pixels, never ranges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
STRAY_SD = 6.0
"""A repeat this far from the median of its fellows is no repeat. Of honest Gaussian repeats 1 in 5e8 lies so
far out when their deviation is stated rightly; stated far too small, 1 in 250 of ten (their own median
absolute deviation is then the measure, and a rough one)."""
FEWEST_FOR_MEDIAN = 10


def weighted_mean(position: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean weighted by 1 / sd^2, and its standard deviation, each (2,).

    Args:
        position: (n, 2) u, v; NaN where a coordinate was not measured: it then counts for nothing.
        sd: (n, 2) 1 sigma, finite.

    Returns:
        NaN and infinity for a coordinate that no repeat measured.
    """
    weight = np.where(np.isfinite(position), 1.0 / sd**2, 0.0)
    total = weight.sum(axis=0)
    known = total > 0
    safe = np.where(known, total, 1.0)
    mean = (weight * np.nan_to_num(position)).sum(axis=0) / safe
    return np.where(known, mean, np.nan), np.where(known, 1.0 / np.sqrt(safe), np.inf)


def strays(position: FloatArray, sd: FloatArray) -> BoolArray:
    """(n,) repeats that lie far from the median of the others in a coordinate that enough of them have."""
    measured = np.isfinite(position)
    stray = np.zeros(position.shape, bool)
    for axis in np.flatnonzero(measured.sum(axis=0) >= FEWEST_FOR_MEDIAN):
        seen = measured[:, axis]
        distance = np.abs(position[seen, axis] - np.median(position[seen, axis]))
        scatter = 1.4826 * np.median(distance)
        stray[seen, axis] = distance > STRAY_SD * np.maximum(scatter, sd[seen, axis])
    return np.asarray(stray.any(axis=1))


def scatter_chi2(position: FloatArray, sd: FloatArray) -> tuple[float, int]:
    """Squared distances of the repeats from their mean in units of sd^2, summed, and how many are free."""
    mean, _ = weighted_mean(position, sd)
    chi2 = float(np.nansum(((position - mean) / sd) ** 2))
    seen = np.isfinite(position).sum(axis=0)
    return chi2, int(np.maximum(seen - 1, 0).sum())
