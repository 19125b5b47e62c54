"""Order in which a grid visits its standoffs.

A drift of the image that follows the standoff is taken for baselines and pointing. The order is therefore
chosen so that time correlates neither with the logarithm of the standoff, which spaces the placements, nor
with its inverse, which moves the spots.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from workbench.model.arrays import FloatArray

SEED = 2001
TRIALS = 500
"""Random orders, of which the one with the smallest correlations is taken."""
RETURN_AT = (2 / 3, 5 / 6)
"""Places in the sorted standoffs of those to return to: far ones, where placement errors move spots least."""


def shuffled(standoffs_mm: Sequence[float]) -> tuple[float, ...]:
    """The standoffs in a random order, always the same for the same standoffs."""
    return tuple(standoffs_mm) if len(standoffs_mm) < 3 else _shuffled(tuple(standoffs_mm))


@lru_cache
def _shuffled(standoffs_mm: tuple[float, ...]) -> tuple[float, ...]:
    """`shuffled`, once: every placement of a session needs the order, which takes a tenth of a second."""
    rng = np.random.default_rng(SEED)
    ordered = np.sort(np.asarray(standoffs_mm, float))
    time = np.arange(len(ordered), dtype=float)
    orders = [rng.permutation(ordered) for _ in range(TRIALS)]
    best = min(orders, key=lambda order: _largest_correlation(time, order))
    return tuple(best.tolist())


def returned(standoffs_mm: Sequence[float], count: int) -> tuple[float, ...]:
    """`count` of the standoffs, to visit again at the end; at most one for each place of RETURN_AT.

    Args:
        standoffs_mm: in the order of the visits.
        count: 0, 1 or 2.
    """
    ordered = sorted(standoffs_mm)
    chosen = dict.fromkeys(ordered[min(int(part * len(ordered)), len(ordered) - 1)] for part in RETURN_AT)
    return tuple(chosen)[:count]


def _largest_correlation(time: FloatArray, order: FloatArray) -> float:
    return max(abs(float(np.corrcoef(time, scale)[0, 1])) for scale in (np.log(order), 1.0 / order))
