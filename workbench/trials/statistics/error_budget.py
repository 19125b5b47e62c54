"""Error budget: observed variance compared with the sum of stated sources, with an alarm.

An observed variance s^2 with nu degrees of freedom has nu s^2 / sigma^2 distributed as chi-square.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from workbench.trials.statistics.estimate import CONFIDENCE, sd_estimate

ALARM_PROBABILITY = (1 - CONFIDENCE) / 2
"""Probability of an alarm where the sources are complete: the lower tail of the two-sided 95 % interval."""


@dataclass(frozen=True)
class ErrorBudget:
    """Budget at one standoff; variances in mm2."""

    observed_mm2: float
    degrees_of_freedom: float
    sources_mm: Mapping[str, float]
    """Standard uncertainty of each source, mm."""

    @property
    def explained_mm2(self) -> float:
        """Sum of the variances of the sources, mm2."""
        return sum(sd**2 for sd in self.sources_mm.values())

    @property
    def unexplained_mm2(self) -> tuple[float, float, float]:
        """Observed - explained variance, mm2, and its 95 % interval; negative: sources too large."""
        observed = sd_estimate(self.observed_mm2, self.degrees_of_freedom)
        return (
            self.observed_mm2 - self.explained_mm2,
            observed.low**2 - self.explained_mm2,
            observed.high**2 - self.explained_mm2,
        )

    @property
    def alarm(self) -> bool:
        """Whether the whole interval of the unexplained variance lies above zero."""
        return self.unexplained_mm2[1] > 0


@dataclass(frozen=True)
class BudgetTest:
    """Budgets of all standoffs, tested together."""

    ratio: float
    """Observed / explained variance, weighted by degrees of freedom; without unit."""
    degrees_of_freedom: float
    probability: float
    """Probability of a larger ratio if the sources are complete."""


def budget_test(budgets: Sequence[ErrorBudget]) -> BudgetTest:
    """Test the budgets of independent standoffs together, for more power than one standoff has.

    Args:
        budgets: at least one; each with at least one source above zero.
    """
    dofs = np.array([one.degrees_of_freedom for one in budgets])
    ratios = np.array([one.observed_mm2 / one.explained_mm2 for one in budgets])
    total, dof = float(dofs @ ratios), float(dofs.sum())
    return BudgetTest(total / dof, dof, float(chi2.sf(total, dof)))
