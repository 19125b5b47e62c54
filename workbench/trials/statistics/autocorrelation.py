"""Lag-1 autocorrelation of successive readings, and how much it widens standard errors.

Sources: Marriott and Pope, Bias in the estimation of autocorrelations, Biometrika 41 (1954); Bartlett, On the
theoretical specification of sampling properties of autocorrelated time series (1946).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import CONFIDENCE

SHORTEST_SERIES = 10
"""Smallest number of successive readings from which a coefficient is estimated: its bias is some -1 / n."""
LARGEST_LAG1 = 0.98
"""Largest lag-1 coefficient used; above it a series holds no information on its mean."""


@dataclass(frozen=True)
class Autocorrelation:
    """First-order autoregressive dependence of readings at one placement."""

    lag1: float = 0.0
    """Lag-1 coefficient used for widening; 0 if it is not significantly positive."""
    estimated: float = 0.0
    """Estimated lag-1 coefficient, corrected for bias, without unit."""
    n: int = 0
    """Number of pairs of successive readings."""

    def variance_factor(self, n: float) -> float:
        """Variance of the mean of n readings, in units of variance / n; 1 for independent readings."""
        if self.lag1 == 0 or n <= 1:
            return 1.0
        rho = self.lag1
        return float((1 + rho) / (1 - rho) - 2 * rho * (1 - rho**n) / (n * (1 - rho) ** 2))

    @property
    def dof_factor(self) -> float:
        """Effective degrees of freedom of a variance, in units of those of independent readings."""
        return (1 - self.lag1**2) / (1 + self.lag1**2)


INDEPENDENT = Autocorrelation()


def autocorrelation(series: Sequence[FloatArray]) -> Autocorrelation:
    """Pooled lag-1 autocorrelation of series of successive readings, each about its own mean.

    A positive coefficient counts if it is significant at 5 % (one-sided, normal approximation). Series of
    fewer than `SHORTEST_SERIES` readings contribute nothing.

    Args:
        series: one array (n,) of readings in the order of time for each placement, any unit.
    """
    used = [one - one.mean() for one in series if len(one) >= SHORTEST_SERIES]
    sum_of_squares = sum(float(one @ one) for one in used)
    pairs = sum(len(one) - 1 for one in used)
    if sum_of_squares == 0:
        return INDEPENDENT
    readings = sum(len(one) for one in used)
    raw = sum(float(one[1:] @ one[:-1]) for one in used) / sum_of_squares
    raw *= readings / pairs  # each series has one product less than squares
    share = len(used) / readings  # 1 / mean length
    # Bias to first order: -(1 + rho) / length by the means, -2 rho / readings by the ratio of sums.
    estimated = (raw + share) / (1 - share - 2 / readings)
    estimated = float(np.clip(estimated, -LARGEST_LAG1, LARGEST_LAG1))
    significant = (raw + share) * np.sqrt(pairs) > norm.ppf(CONFIDENCE)
    return Autocorrelation(estimated if significant else 0.0, estimated, pairs)


def standard_error(values: FloatArray, dependence: Autocorrelation) -> float:
    """Standard error of the mean of successive readings (n,), n > 1, in their unit.

    The sample variance is corrected for its own bias under the dependence.
    """
    n, factor = len(values), dependence.variance_factor(len(values))
    variance = float(values.var(ddof=1)) * (n - 1) / (n - factor)
    return float(np.sqrt(variance * factor / n))
