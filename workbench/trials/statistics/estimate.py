"""Estimate with a two-sided interval, and the error of too few readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, t

from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError

CONFIDENCE = 0.95
"""Confidence of every two-sided interval."""


class TooFewReadingsError(BadInputError):
    """The readings are too few for a statistic; the text states how many are needed."""


@dataclass(frozen=True)
class Estimate:
    """Estimate with its two-sided 95 % interval, in the unit of the value."""

    value: float
    low: float
    high: float
    degrees_of_freedom: float
    """Degrees of freedom of the value, possibly effective ones."""


def require(count: int, least: int, of: str) -> None:
    """Check a number of readings, placements or sessions.

    Raises:
        TooFewReadingsError: `count` is below `least`.
    """
    if count < least:
        raise TooFewReadingsError(f"expected at least {least} {of}, got {count}")


def mean_estimate(values: FloatArray) -> Estimate:
    """Mean of independent values (n,) with Student's interval, in their unit, n - 1 degrees of freedom.

    Raises:
        TooFewReadingsError: fewer than two values.
    """
    require(len(values), 2, "values")
    mean, dof = float(values.mean()), len(values) - 1
    half = float(t.ppf(0.5 + CONFIDENCE / 2, dof) * values.std(ddof=1) / np.sqrt(len(values)))
    return Estimate(mean, mean - half, mean + half, dof)


def sd_estimate(variance: float, dof: float) -> Estimate:
    """Standard deviation of a variance with `dof` degrees of freedom, interval by chi-square.

    Args:
        variance: estimated variance of normal values, for example mm2.
        dof: its degrees of freedom, above 0.
    """
    upper, lower = (float(chi2.ppf(0.5 + side * CONFIDENCE / 2, dof)) for side in (1, -1))
    return Estimate(
        float(np.sqrt(variance)),
        float(np.sqrt(variance * dof / upper)),
        float(np.sqrt(variance * dof / lower)),
        dof,
    )
