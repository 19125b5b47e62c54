"""Share of readings inside their stated interval, and exact binomial intervals (Clopper, Pearson 1934)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.stats import beta

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import CONFIDENCE, Estimate, require


def clopper_pearson(successes: float, n: float, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Two-sided interval of a probability from `successes` of n independent trials.

    At 0 or n successes the error probability is still halved. Fractional numbers are effective ones.

    Raises:
        TooFewReadingsError: n < 1.
        ValueError: successes are not within 0 to n.
    """
    require(int(n), 1, "trials")
    if not 0 <= successes <= n:
        raise ValueError(f"expected 0 to {n:g} successes, got {successes:g}")
    tail = (1 - confidence) / 2
    low = 0.0 if successes == 0 else float(beta.ppf(tail, successes, n - successes + 1))
    high = 1.0 if successes == n else float(beta.ppf(1 - tail, successes + 1, n - successes))
    return low, high


def upper_bound(successes: float, n: float, confidence: float = CONFIDENCE) -> float:
    """One-sided upper bound of a probability from `successes` of n independent trials."""
    return 1.0 if successes == n else float(beta.ppf(confidence, successes + 1, n - successes))


def effective_number(correlation: FloatArray) -> float:
    """Number of independent trials that hold as much information on a variance as n correlated normal ones.

    n^2 / sum(rho_ij^2): squares of normal values have the correlations rho^2.

    Args:
        correlation: (n, n) correlation matrix of the values, n at least 1.
    """
    return max(1.0, float(len(correlation) ** 2 / np.square(correlation).sum()))


def interval_coverage(readings: pd.DataFrame) -> Estimate:
    """Share of readings with abs(error) <= U, with its interval.

    Readings of one placement share its error and are not independent: the interval counts placements, each
    with the share of its readings inside.

    Args:
        readings: one row a reading with `error_mm`, `expanded_mm` (U of its stated 95 % interval) and
            `placement`; rows without an error are left out.

    Raises:
        TooFewReadingsError: no reading has an error.
    """
    used = readings.dropna(subset=["error_mm", "expanded_mm"])
    inside = used["error_mm"].abs() <= used["expanded_mm"]
    shares = inside.groupby(used["placement"]).mean()
    require(len(shares), 1, "placements with readings")
    low, high = clopper_pearson(float(shares.sum()), len(shares))
    return Estimate(float(np.mean(shares)), low, high, len(shares))
