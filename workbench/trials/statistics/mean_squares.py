"""Interval of a sum of mean squares with positive weights: the modified large-sample method.

Source: Graybill and Wang, Confidence intervals on nonnegative linear combinations of variances, JASA 75
(1980).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from workbench.trials.statistics.estimate import CONFIDENCE, Estimate


def combined_sd(weights: Sequence[float], mean_squares: Sequence[float], dofs: Sequence[float]) -> Estimate:
    """Square root of sum(weight * mean square), with its 95 % interval.

    The degrees of freedom are effective ones (Satterthwaite).

    Args:
        weights: (n,) weights, not negative.
        mean_squares: (n,) independent mean squares of normal values, for example mm2.
        dofs: (n,) degrees of freedom, above 0.
    """
    terms, dof = np.multiply(weights, mean_squares), np.asarray(dofs, float)
    total = float(terms.sum())
    below = 1 - dof / chi2.ppf(0.5 + CONFIDENCE / 2, dof)
    above = dof / chi2.ppf(0.5 - CONFIDENCE / 2, dof) - 1
    low = max(0.0, total - float(np.sqrt(((below * terms) ** 2).sum())))
    high = total + float(np.sqrt(((above * terms) ** 2).sum()))
    spread = float((terms**2 / dof).sum())
    effective = total**2 / spread if spread > 0 else float(dof.sum())
    return Estimate(float(np.sqrt(total)), float(np.sqrt(low)), float(np.sqrt(high)), effective)
