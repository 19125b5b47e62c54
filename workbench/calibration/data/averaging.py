"""Averaging repeated readings of one spot, coordinate by coordinate. Average pixels, never ranges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import chi2_isf, chi2_sf

STRAY_SD = 6.0
"""A repeat this far from the median of its fellows is no repeat. Of honest Gaussian repeats 1 in 5e8 lies so
far out when their deviation is stated rightly; stated far too small, 1 in 250 of ten (their own median
absolute deviation is then the measure, and a rough one)."""
FEWEST_FOR_MEDIAN = 10
STRAY_SD_OF_FEW = 8.0
"""The same for 3 to 9 repeats, measured by what other spots' repeats scatter: hardly 1 in 1e9 of three."""
FEWEST_SPOTS = 8
"""Whose repeats tell what repeats usually scatter."""
TORN = 1e-9
"""Repeats that scatter together as improbably as this do not show one spot."""


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


def strays_of_few(position: FloatArray, sd: FloatArray) -> BoolArray:
    """(n,) as `strays`, of 3 to 9 repeats whose deviation `sd` other spots have confirmed."""
    measured = np.isfinite(position)
    stray = np.zeros(position.shape, bool)
    count = measured.sum(axis=0)
    for axis in np.flatnonzero((count >= 3) & (count < FEWEST_FOR_MEDIAN)):
        seen = measured[:, axis]
        distance = np.abs(position[seen, axis] - np.median(position[seen, axis]))
        stray[seen, axis] = distance > STRAY_SD_OF_FEW * sd[seen, axis]
    return np.asarray(stray.any(axis=1))


def usual_scale(scatter: Sequence[tuple[float, int]]) -> float:
    """What repeats usually scatter over what is stated, at least 1; NaN where too few spots tell.

    The median over spots: up to half of them may be spoilt.

    Args:
        scatter: `scatter_chi2` of each spot.
    """
    chi2, free = np.array([s for s in scatter if s[1] > 0]).reshape(-1, 2).T
    if len(chi2) < FEWEST_SPOTS:
        return float("nan")
    return max(1.0, float(np.sqrt(np.median(chi2 / chi2_isf(0.5, free)))))


def is_torn(scatter: tuple[float, int], usual: float) -> bool:
    """Whether the repeats of a spot scatter far more than those of others do."""
    chi2, free = scatter
    return free > 0 and bool(chi2_sf(chi2 / usual**2, free) < TORN)  # NaN: nothing to compare with


def scatter_chi2(position: FloatArray, sd: FloatArray) -> tuple[float, int]:
    """Squared distances of the repeats from their mean in units of sd^2, summed, and how many are free."""
    mean, _ = weighted_mean(position, sd)
    chi2 = float(np.nansum(((position - mean) / sd) ** 2))
    seen = np.isfinite(position).sum(axis=0)
    return chi2, int(np.maximum(seen - 1, 0).sum())
