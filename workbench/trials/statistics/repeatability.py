"""Repeatability and reproducibility of readings at one level (ISO 5725-2), and its tests for outliers.

The level is a true range. The "laboratory" of the standard is a re-placement of the target, because repeats
at one placement share its error and its speckle. Placements may be nested in sessions; reproducibility then
includes the differences between sessions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import f as f_distribution
from scipy.stats import t

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.autocorrelation import INDEPENDENT, Autocorrelation
from workbench.trials.statistics.estimate import Estimate, require, sd_estimate
from workbench.trials.statistics.mean_squares import combined_sd
from workbench.trials.statistics.nested import NestedSquares, nested_squares

LIMIT_FACTOR = 2.8
"""Limit of the difference of two readings in units of their standard deviation, rounded as in ISO 5725-6."""


@dataclass(frozen=True)
class OutlierTest:
    """Test of the most deviating group."""

    group: object
    """Label of the group."""
    statistic: float
    probability: float
    """Probability of a more extreme statistic without an outlier (Bonferroni bound)."""


@dataclass(frozen=True)
class Repeatability:
    """Precision at one level; standard deviations in the unit of the readings (mm)."""

    repeatability: Estimate
    """s_r, of readings at one placement."""
    between_placements: float
    """s_L, of the placements' own errors; 0 if the estimated variance is negative."""
    between_sessions: float | None
    """Of the sessions' own errors; None with one session."""
    reproducibility: Estimate
    """s_R, of readings at new placements (and in new sessions, if there are several)."""
    unbiased_variance: float
    """Square of s_R without the truncation of negative components at 0, in the squared unit of the readings;
    its expectation is the true variance, which that of s_R^2 exceeds."""
    readings: int
    placements: int
    sessions: int

    @property
    def repeatability_limit(self) -> float:
        """r: two readings at one placement differ by less with a probability of 95 %."""
        return LIMIT_FACTOR * self.repeatability.value

    @property
    def reproducibility_limit(self) -> float:
        """R: two readings at different placements differ by less with a probability of 95 %."""
        return LIMIT_FACTOR * self.reproducibility.value


def repeatability(readings: pd.DataFrame, dependence: Autocorrelation = INDEPENDENT) -> Repeatability:
    """Precision of readings at one level, with 95 % intervals.

    The interval of s_r is exact for independent normal readings (chi-square), that of s_R by the modified
    large-sample method. Autocorrelated repeats lower the effective degrees of freedom and make s_r too small;
    both are corrected.

    Args:
        readings: one row a reading with `error_mm`, `placement` and, if there are several, `session`.
        dependence: autocorrelation of the repeats.

    Raises:
        TooFewReadingsError: fewer than two placements, or no placement with two readings.
    """
    squares = nested_squares(readings)
    require(squares.placements, 2, "placements")
    require(squares.within_dof + 1, 2, "readings at one placement")
    size = squares.placement_size
    factor = dependence.variance_factor(size)
    within = _within(squares.within, size, dependence)
    placement_variance = max(0.0, (squares.placement - factor * within) / size)
    session_variance = _session_variance(squares, factor * within)
    total = _total(squares, dependence)
    return Repeatability(
        repeatability=_repeats(within, squares.within_dof, dependence),
        between_placements=float(np.sqrt(placement_variance)),
        between_sessions=None if session_variance is None else float(np.sqrt(session_variance)),
        reproducibility=_reproducibility(total, within + placement_variance + (session_variance or 0.0)),
        unbiased_variance=total.value**2,
        readings=squares.readings,
        placements=squares.placements,
        sessions=squares.sessions,
    )


def repeatability_alone(readings: pd.DataFrame, dependence: Autocorrelation = INDEPENDENT) -> Estimate:
    """s_r where the placements are too few for s_R: the first part of `repeatability`, also of one placement.

    Args:
        readings: one row a reading with `error_mm`, `session` and `placement`.
        dependence: autocorrelation of the repeats.

    Raises:
        TooFewReadingsError: no placement with two readings.
    """
    groups = readings.groupby(["session", "placement"])["error_mm"]
    dof = len(readings) - groups.ngroups
    require(dof + 1, 2, "readings at one placement")
    squares = float(((readings["error_mm"] - groups.transform("mean")) ** 2).sum())
    within = _within(squares / dof, len(readings) / groups.ngroups, dependence)
    return _repeats(within, dof, dependence)


def _within(mean_square: float, size: float, dependence: Autocorrelation) -> float:
    """Variance of a reading from the mean square within placements of `size` readings."""
    factor = dependence.variance_factor(size)
    return mean_square * (size - 1) / (size - factor) if size > factor else mean_square


def _repeats(variance: float, dof: int, dependence: Autocorrelation) -> Estimate:
    """s_r with its interval, wider for autocorrelated repeats."""
    return sd_estimate(variance, max(1.0, dof * dependence.dof_factor))


def _session_variance(squares: NestedSquares, mean_variance: float) -> float | None:
    """Variance between sessions; `mean_variance`: expected mean square of readings alone."""
    if squares.session is None:
        return None
    placement = (squares.placement - mean_variance) / squares.placement_size
    expected = mean_variance + squares.session_placement_size * placement
    return max(0.0, (squares.session - expected) / squares.session_size)


def _total(squares: NestedSquares, dependence: Autocorrelation) -> Estimate:
    """Standard deviation of readings at new placements by the sum of mean squares, without truncation."""
    weights, values, dofs = squares.total_variance()
    dofs[-1] = max(1.0, dofs[-1] * dependence.dof_factor)
    return combined_sd(weights, values, dofs)


def _reproducibility(total: Estimate, variance: float) -> Estimate:
    """s_R of the truncated components, with the interval of their sum without truncation."""
    value = float(np.sqrt(variance))
    return Estimate(value, min(value, total.low), max(value, total.high), total.degrees_of_freedom)


def cochran(readings: pd.DataFrame) -> OutlierTest:
    """Cochran's test of the placement with the largest variance, C = max s_i^2 / sum(s_i^2).

    The probability is exact for equal numbers of repeats; otherwise that of their mean number.

    Args:
        readings: one row a reading with `error_mm` and `placement`.

    Raises:
        TooFewReadingsError: fewer than two placements with two readings.
    """
    groups = readings.groupby("placement")["error_mm"]
    variances = groups.var(ddof=1).dropna()
    require(len(variances), 2, "placements with two readings")
    dof = float(groups.count()[variances.index].mean()) - 1
    values: FloatArray = np.asarray(variances, np.float64)
    probability = largest_variance_probability(values, dof)
    return OutlierTest(variances.idxmax(), _largest_share(values), probability)


def largest_variance_probability(variances: FloatArray, dof: float) -> float:
    """P value of Cochran's test of the largest of n variances, each with `dof` degrees of freedom."""
    count, largest = len(variances), _largest_share(variances)
    ratio = np.inf if largest >= 1 else largest * (count - 1) / (1 - largest)
    return min(1.0, count * float(f_distribution.sf(ratio, dof, (count - 1) * dof)))


def _largest_share(variances: FloatArray) -> float:
    """Cochran's C; 1 / n if all variances are 0."""
    total = float(variances.sum())
    return float(variances.max()) / total if total > 0 else 1 / len(variances)


def grubbs(means: pd.Series[float]) -> OutlierTest:
    """Grubbs' two-sided test of the mean farthest from the others, G = abs(x - mean) / s.

    Args:
        means: (p,) mean of each placement, indexed by placement.

    Raises:
        TooFewReadingsError: fewer than three placements.
    """
    require(len(means), 3, "placements")
    values: FloatArray = np.asarray(means, np.float64)
    count, sd = len(values), float(values.std(ddof=1))
    away = np.abs(values - values.mean())
    farthest = int(away.argmax())
    statistic = float(away[farthest]) / sd if sd > 0 else 0.0
    left = (count - 1) ** 2 - count * statistic**2
    score = np.inf if left <= 0 else statistic * np.sqrt(count * (count - 2) / left)
    probability = min(1.0, 2 * count * float(t.sf(score, count - 2)))
    return OutlierTest(means.index[farthest], statistic, probability)
