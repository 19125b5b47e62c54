"""When residuals are larger than the stated noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf

SCATTER_SIGNIFICANCE = 0.01
"""Residuals less likely than this under the stated noise make the fit estimate the noise from them."""


def scale_called_for(chi2: ArrayLike, freedom: ArrayLike) -> FloatArray:
    """Factor on the stated noise that residuals of this chi2 call for, 1 where they agree with it."""
    chi2, freedom = np.asarray(chi2, float), np.asarray(freedom, float)
    countable = np.where(freedom > 0, freedom, 1.0)
    improbable = (freedom > 0) & (chi2_sf(chi2, countable) < SCATTER_SIGNIFICANCE)
    return np.where(improbable, np.maximum(1.0, np.sqrt(chi2 / countable)), 1.0)
