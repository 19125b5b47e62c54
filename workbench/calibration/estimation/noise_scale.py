"""Scale of the noise where residuals are significantly larger than stated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf

SCATTER_SIGNIFICANCE = 0.01
"""P value of the residuals, under the stated noise, below which the noise is estimated from them."""


def significant_scale(chi2: ArrayLike, freedom: ArrayLike) -> FloatArray:
    """Factor on the stated noise, sqrt(chi2 / freedom) where chi2 is significantly too large, else 1."""
    chi2, freedom = np.asarray(chi2, float), np.asarray(freedom, float)
    countable = np.where(freedom > 0, freedom, 1.0)
    improbable = (freedom > 0) & (chi2_sf(chi2, countable) < SCATTER_SIGNIFICANCE)
    return np.where(improbable, np.maximum(1.0, np.sqrt(chi2 / countable)), 1.0)
