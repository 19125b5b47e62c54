"""Bootstrap interval of a mean of values in independent groups (Davison, Hinkley 1997, section 3.8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import CONFIDENCE, Estimate, require

DRAWS = 2000
SEED = 1
"""Draws are always the same, so that equal data give equal intervals."""


def grouped_mean(groups: Sequence[FloatArray]) -> Estimate:
    """Mean of all values, with the percentile interval over groups drawn with replacement.

    Args:
        groups: values of each group, in one unit; at least one value a group.

    Raises:
        TooFewReadingsError: fewer than two groups.
    """
    require(len(groups), 2, "groups")
    sums, counts = np.array([group.sum() for group in groups]), np.array([len(group) for group in groups])
    drawn = np.random.default_rng(SEED).integers(0, len(groups), (DRAWS, len(groups)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]).tolist()
    return Estimate(float(sums.sum() / counts.sum()), low, high, len(groups) - 1)
