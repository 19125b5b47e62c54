"""Resolution of readings: a step so coarse that tests for normal errors do not apply."""

from __future__ import annotations

import numpy as np
import pandas as pd

COARSE = 1.0
"""Scatter of repeats, in steps, below which most repeats are equal and their variances are not chi-square."""


def coarse_step(readings: pd.DataFrame) -> float | None:
    """Smallest difference of two readings at one level, mm, if the scatter of repeats is smaller; else None.

    Args:
        readings: one row a reading with `measured_mm`, without gaps, and `placement`.
    """
    values = np.unique(readings["measured_mm"].to_numpy(np.float64))
    if len(values) in (1, len(readings)):  # no step is known, or every reading differs: no repeated value
        return None
    step_mm = float(np.diff(values).min())
    variance = readings.groupby("placement")["measured_mm"].var(ddof=1).mean()
    return step_mm if np.sqrt(variance) < COARSE * step_mm else None
