"""Readings at the end of a sensor's scale: clipped values, which have no error distribution."""

from __future__ import annotations

import numpy as np
import pandas as pd

from workbench.model.arrays import BoolArray

FEWEST = 3
"""Smallest number of equal readings at one true range that can be clipped."""
SHARE = 0.25
"""Smallest share of equal readings at one true range that can be clipped."""
RATIO = 2.0
"""Clipped readings repeat this factor more often than any other reading: resolution repeats values too."""


def clipped(readings: pd.DataFrame) -> BoolArray:
    """Whether each reading (n,) is clipped at the largest or smallest reading of all.

    A limit counts if it repeats exactly at one true range, more often than other values do elsewhere, or if
    it repeats at two true ranges.

    Args:
        readings: one row a reading with `standoff_mm` (level) and `measured_mm`; a gap is not clipped.
    """
    measured = readings["measured_mm"].to_numpy(np.float64)
    if np.isnan(measured).all() or readings["standoff_mm"].nunique() < 2:
        return np.zeros(len(readings), np.bool_)
    found = np.zeros(len(readings), np.bool_)
    for limit in {float(np.nanmin(measured)), float(np.nanmax(measured))}:
        found |= (measured == limit) & readings["standoff_mm"].isin(_levels_at(readings, limit)).to_numpy()
    return found


def _levels_at(readings: pd.DataFrame, limit: float) -> list[float]:
    """Levels at which readings are clipped at the limit."""
    values = readings.dropna(subset=["measured_mm"]).groupby("standoff_mm")["measured_mm"]
    at_limit = values.agg(lambda level: int((level == limit).sum()))
    share = at_limit / values.count()
    others = readings[readings["measured_mm"] != limit].dropna(subset=["measured_mm"])
    repeated = others.groupby("standoff_mm")["measured_mm"].agg(
        lambda level: level.value_counts(normalize=True).max()
    )
    candidates = [float(level) for level in at_limit.index[(at_limit >= FEWEST) & (share >= SHARE)]]
    if len(candidates) > 1:
        return candidates
    usual = float(repeated.max()) if len(repeated) else 1.0
    return [level for level in candidates if share[level] >= RATIO * usual]
