"""Expanded uncertainty from few readings: effective degrees of freedom (GUM, JCGM 100:2008, annex G.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from workbench.model.stats import t_ppf
from workbench.trials.statistics.estimate import CONFIDENCE


@dataclass(frozen=True)
class CombinedUncertainty:
    """Combined standard uncertainty with its expansion, in the unit of its components."""

    u: float
    """Combined standard uncertainty."""
    degrees_of_freedom: float
    """Effective degrees of freedom; infinite if every component is exactly known."""
    k: float
    """Coverage factor: Student's t for the confidence and the degrees of freedom."""

    @property
    def expanded(self) -> float:
        """Expanded uncertainty U = k u."""
        return self.k * self.u


def effective_degrees_of_freedom(u: Sequence[float], dofs: Sequence[float]) -> float:
    """nu_eff = u_c^4 / sum(u_i^4 / nu_i).

    Args:
        u: (n,) independent standard uncertainties in one unit.
        dofs: (n,) degrees of freedom, above 0; infinite for a component that is exactly known.
    """
    variances = np.square(np.asarray(u, float))
    spread = float((variances**2 / np.asarray(dofs, float)).sum())
    return float(variances.sum() ** 2 / spread) if spread > 0 else inf


def combine(u: Sequence[float], dofs: Sequence[float], confidence: float = CONFIDENCE) -> CombinedUncertainty:
    """Combined uncertainty of independent components and the coverage factor of a two-sided interval.

    The coverage factor is that of the effective degrees of freedom, not truncated to an integer (GUM G.4.2).

    Args:
        u: (n,) independent standard uncertainties in one unit.
        dofs: (n,) degrees of freedom, above 0.
        confidence: coverage probability of the interval +- U.
    """
    dof = effective_degrees_of_freedom(u, dofs)
    combined = float(np.sqrt(np.square(np.asarray(u, float)).sum()))
    return CombinedUncertainty(combined, dof, float(t_ppf(0.5 + confidence / 2, dof)))
