"""Gauge repeatability and reproducibility by analysis of variance, crossed design (AIAG MSA, 4th edition).

Variance components follow from expected mean squares of the random model. The interaction is pooled with the
repeatability if its F test gives p > 0.25, as in AIAG's manual. Intervals: modified large-sample method
(Burdick, Borror and Montgomery, Journal of Quality Technology 35, 2003). They assume equal repeatability of
all parts and operators, which Cochran's test checks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np
import pandas as pd
from scipy.stats import f as f_distribution

from workbench.model.errors import BadInputError
from workbench.trials.statistics.estimate import Estimate, require, sd_estimate
from workbench.trials.statistics.mean_squares import combined_sd
from workbench.trials.statistics.repeatability import largest_variance_probability

POOLING_PROBABILITY = 0.25
"""The interaction is pooled if its p value is above this (AIAG)."""
HETEROGENEOUS_PROBABILITY = 0.05
"""P value below which the repeatability differs between parts or operators: no pooled interval holds."""
NDC_FACTOR = 1.41
"""Number of distinct categories = 1.41 PV / GRR (AIAG)."""


@dataclass(frozen=True)
class GaugeStudy:
    """Standard deviations of a gauge study, in the unit of the readings (mm)."""

    equipment: Estimate
    """EV: repeatability."""
    appraiser: float
    """AV: between operators, without the interaction."""
    interaction: float | None
    """Of operators and parts; None if it is pooled with EV."""
    gauge: Estimate
    """GRR: sqrt(EV^2 + AV^2 + interaction^2)."""
    part: float
    """PV: between parts."""
    interaction_probability: float
    """p value of the interaction's F test."""
    homogeneity_probability: float
    """p value of equal repeatability of all parts and operators, which the intervals assume."""
    parts: int
    operators: int
    trials: int
    """Number of trials of each part by each operator."""

    @property
    def has_intervals(self) -> bool:
        """Whether the intervals of EV and GRR hold: the repeatability does not differ significantly."""
        return self.homogeneity_probability >= HETEROGENEOUS_PROBABILITY

    @property
    def total(self) -> float:
        """TV: sqrt(GRR^2 + PV^2)."""
        return float(np.hypot(self.gauge.value, self.part))

    @property
    def gauge_share(self) -> float:
        """GRR / TV, share of study variation; without unit."""
        return self.gauge.value / self.total if self.total > 0 else 0.0

    @property
    def distinct_categories(self) -> float:
        """Ndc before it is truncated to an integer; infinite if GRR is 0."""
        return NDC_FACTOR * self.part / self.gauge.value if self.gauge.value > 0 else inf


@dataclass(frozen=True)
class _CrossedSquares:
    """Mean squares of a balanced crossed design."""

    part: float
    operator: float
    interaction: float
    error: float
    error_dof: int
    parts: int
    operators: int
    trials: int
    pooled: bool = False
    """Whether the interaction is pooled with the error; both mean squares are then equal."""

    @property
    def interaction_dof(self) -> int:
        """Degrees of freedom of the interaction."""
        return (self.parts - 1) * (self.operators - 1)

    @property
    def interaction_probability(self) -> float:
        """Probability of a larger F of the interaction where there is none."""
        ratio = self.interaction / self.error if self.error > 0 else inf
        return float(f_distribution.sf(ratio, self.interaction_dof, self.error_dof))

    def with_pooled_interaction(self) -> _CrossedSquares:
        """The same with interaction and error in one mean square."""
        dof = self.interaction_dof + self.error_dof
        both = (self.interaction * self.interaction_dof + self.error * self.error_dof) / dof
        return replace(self, interaction=both, error=both, error_dof=dof, pooled=True)


def gauge_rr(readings: pd.DataFrame) -> GaugeStudy:
    """Variance components of a balanced crossed study.

    Args:
        readings: one row a reading with `part`, `operator` and `measured_mm`.

    Raises:
        TooFewReadingsError: fewer than two parts, operators or trials.
        BadInputError: the design is not balanced: a part lacks readings of an operator.
    """
    squares = _crossed_squares(readings)
    probability = squares.interaction_probability
    if pooled := probability > POOLING_PROBABILITY:
        squares = squares.with_pooled_interaction()
    trials, parts, operators = squares.trials, squares.parts, squares.operators
    interaction = max(0.0, (squares.interaction - squares.error) / trials)
    appraiser = max(0.0, (squares.operator - squares.interaction) / (parts * trials))
    part = max(0.0, (squares.part - squares.interaction) / (operators * trials))
    return GaugeStudy(
        equipment=sd_estimate(squares.error, squares.error_dof),
        appraiser=float(np.sqrt(appraiser)),
        interaction=None if pooled else float(np.sqrt(interaction)),
        gauge=_gauge(squares, squares.error + interaction + appraiser),
        part=float(np.sqrt(part)),
        interaction_probability=probability,
        homogeneity_probability=_homogeneity_probability(readings),
        parts=parts,
        operators=operators,
        trials=trials,
    )


def _homogeneity_probability(readings: pd.DataFrame) -> float:
    """P value of equal variances within cells: Cochran's test over parts, and over operators (Bonferroni).

    The variances of a part's (an operator's) cells are pooled. That of a single cell has few degrees of
    freedom, and a test over cells would rarely find a repeatability that grows with the range.
    """
    cells = readings.groupby(["part", "operator"])["measured_mm"].var(ddof=1)
    trials = len(readings) / len(cells)
    found = []
    for name in ("part", "operator"):
        pooled = cells.groupby(name).mean()
        dof = (trials - 1) * len(cells) / len(pooled)
        found.append(largest_variance_probability(np.asarray(pooled, np.float64), dof))
    return min(1.0, 2.0 * min(found))


def _gauge(squares: _CrossedSquares, variance: float) -> Estimate:
    """GRR with the interval of the sum of mean squares that estimates its variance without truncation."""
    share = 1 / (squares.parts * squares.trials)
    weights = [share, 1 / squares.trials - share, 1 - 1 / squares.trials]
    values = [squares.operator, squares.interaction, squares.error]
    dofs = [squares.operators - 1, squares.interaction_dof, squares.error_dof]
    if squares.pooled:  # one mean square, with the degrees of freedom of both
        weights, values, dofs = [share, 1 - share], [values[0], values[2]], [dofs[0], dofs[2]]
    interval = combined_sd(weights, values, dofs)
    value = float(np.sqrt(variance))
    return Estimate(value, min(value, interval.low), max(value, interval.high), interval.degrees_of_freedom)


def _crossed_squares(readings: pd.DataFrame) -> _CrossedSquares:
    cells = readings.groupby(["part", "operator"])["measured_mm"]
    counts = cells.count().unstack(fill_value=0)
    parts, operators = counts.shape
    require(parts, 2, "parts")
    require(operators, 2, "operators")
    trials = int(counts.to_numpy().max())
    if (counts.to_numpy() != trials).any():
        part, operator = np.argwhere(counts.to_numpy() != trials)[0]
        raise BadInputError(
            f"expected {trials} readings of every part by every operator, got {counts.iloc[part, operator]}"
            f" of part {counts.index[part]} by operator {counts.columns[operator]}"
        )
    require(trials, 2, "trials of each part by each operator")
    means = cells.mean().unstack().to_numpy(np.float64)
    grand, of_part, of_operator = means.mean(), means.mean(axis=1), means.mean(axis=0)
    both = means - of_part[:, None] - of_operator + grand
    within = float(((readings["measured_mm"] - cells.transform("mean")) ** 2).sum())
    return _CrossedSquares(
        part=float(operators * trials * ((of_part - grand) ** 2).sum() / (parts - 1)),
        operator=float(parts * trials * ((of_operator - grand) ** 2).sum() / (operators - 1)),
        interaction=float(trials * (both**2).sum() / ((parts - 1) * (operators - 1))),
        error=within / (parts * operators * (trials - 1)),
        error_dof=parts * operators * (trials - 1),
        parts=parts,
        operators=operators,
        trials=trials,
    )
