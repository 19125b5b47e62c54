"""Averages of repeated observations of one spot, coordinate by coordinate, in pixels.

Positions are averaged, not ranges: a range is a non-linear function of the position, and its mean is biased.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import chi2_isf, chi2_sf

OUTLIER_SD = 6.0
"""Distance from the median at which one of 10 or more repeats is rejected. Of Gaussian repeats with the
stated deviation, 1 in 5e8 is rejected. Where the stated deviation is far too small, the median absolute
deviation of the repeats replaces it, a rough estimate: of ten repeats, 1 in 250 is rejected."""
FEWEST_FOR_MEDIAN = 10
OUTLIER_SD_OF_FEW = 8.0
"""The same for 3 to 9 repeats, in deviations confirmed by the repeats of other spots: 1 in 1e9 of three."""
FEWEST_SPOTS = 8
"""Number of spots needed to estimate the usual scatter of repeats."""
INCONSISTENT_P = 1e-9
"""P value of their scatter below which the repeats of a spot are inconsistent."""


def weighted_mean(position: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean weighted by 1 / sd^2, and its standard deviation, each (2,).

    Args:
        position: (n, 2) u, v; NaN where a coordinate was not measured: it has no weight.
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


def outliers(position: FloatArray, sd: FloatArray) -> BoolArray:
    """(n,) repeats more than OUTLIER_SD from their median, in coordinates with at least 10 measurements.

    Args:
        position: (n, 2) px, NaN where not measured.
        sd: (n, 2) px, 1 sigma; the median absolute deviation is used where it is larger.
    """
    measured = np.isfinite(position)
    outlying = np.zeros(position.shape, bool)
    for axis in np.flatnonzero(measured.sum(axis=0) >= FEWEST_FOR_MEDIAN):
        seen = measured[:, axis]
        distance = np.abs(position[seen, axis] - np.median(position[seen, axis]))
        scatter = 1.4826 * np.median(distance)
        outlying[seen, axis] = distance > OUTLIER_SD * np.maximum(scatter, sd[seen, axis])
    return np.asarray(outlying.any(axis=1))


def outliers_of_few(position: FloatArray, sd: FloatArray) -> BoolArray:
    """(n,) as `outliers`, for 3 to 9 repeats with deviations `sd` that the repeats of other spots confirm."""
    measured = np.isfinite(position)
    outlying = np.zeros(position.shape, bool)
    count = measured.sum(axis=0)
    for axis in np.flatnonzero((count >= 3) & (count < FEWEST_FOR_MEDIAN)):
        seen = measured[:, axis]
        distance = np.abs(position[seen, axis] - np.median(position[seen, axis]))
        outlying[seen, axis] = distance > OUTLIER_SD_OF_FEW * sd[seen, axis]
    return np.asarray(outlying.any(axis=1))


def usual_scale(scatter: Sequence[tuple[float, int]]) -> float:
    """Usual ratio of the scatter of repeats to the stated deviation, at least 1; NaN with too few spots.

    The median over spots, robust against up to half of them.

    Args:
        scatter: `scatter_chi2` of each spot.
    """
    chi2, free = np.array([s for s in scatter if s[1] > 0]).reshape(-1, 2).T
    if len(chi2) < FEWEST_SPOTS:
        return float("nan")
    return max(1.0, float(np.sqrt(np.median(chi2 / chi2_isf(0.5, free)))))


def is_inconsistent(scatter: tuple[float, int], usual: float) -> bool:
    """Whether the repeats of a spot scatter far more than usual (`usual_scale`; NaN: never)."""
    chi2, free = scatter
    return free > 0 and bool(chi2_sf(chi2 / usual**2, free) < INCONSISTENT_P)


def scatter_chi2(position: FloatArray, sd: FloatArray) -> tuple[float, int]:
    """Chi-square of the repeats about their mean (n, 2), and its degrees of freedom."""
    mean, _ = weighted_mean(position, sd)
    chi2 = float(np.nansum(((position - mean) / sd) ** 2))
    seen = np.isfinite(position).sum(axis=0)
    return chi2, int(np.maximum(seen - 1, 0).sum())
