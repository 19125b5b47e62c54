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
"""Clipped readings repeat this factor more often than any other reading, or lie this factor of the errors at
other levels from the true range: resolution repeats values too."""


def clipped(readings: pd.DataFrame) -> BoolArray:
    """Whether each reading (n,) is clipped at the largest or smallest reading of all.

    A coarse resolution repeats values too. A limit that repeats exactly at a true range therefore counts only
    - if that true range lies beyond it, by more than the resolution and the errors at other true ranges, or
    - if the other readings there scatter by more than the resolution, and the limit repeats more often than
      other values do elsewhere, or repeats so at two true ranges.

    Args:
        readings: one row a reading with `standoff_mm` (level) and `measured_mm`; a gap is not clipped.
    """
    measured = readings["measured_mm"].to_numpy(np.float64)
    found = np.zeros(len(readings), np.bool_)
    if np.isnan(measured).all() or readings["standoff_mm"].nunique() < 2:
        return found
    for limit, side in ((float(np.nanmin(measured)), -1.0), (float(np.nanmax(measured)), 1.0)):
        at_levels = readings["standoff_mm"].isin(_levels_at(readings, limit, side)).to_numpy()
        found |= (measured == limit) & at_levels
    return found


def _levels_at(readings: pd.DataFrame, limit: float, side: float) -> list[float]:
    """Levels at which readings are clipped at the limit; `side`: 1 for an upper limit, -1 for a lower one."""
    used = readings.dropna(subset=["measured_mm"])
    values = used.groupby("standoff_mm")["measured_mm"]
    at_limit = values.agg(lambda level: int((level == limit).sum()))
    share = at_limit / values.count()
    others = used[used["measured_mm"] != limit].groupby("standoff_mm")["measured_mm"]
    candidates = [float(level) for level in at_limit.index[(at_limit >= FEWEST) & (share >= SHARE)]]
    step_mm, scatter_mm = _resolution_mm(used), others.std(ddof=0)
    margin_mm = step_mm + RATIO * _largest_error_mm(values.mean(), candidates)
    beyond = [level for level in candidates if side * (level - limit) > margin_mm]
    scattered = [level for level in candidates if scatter_mm.get(level, 0.0) > step_mm]
    if len({*beyond, *scattered}) == 1 and not beyond:
        usual = float(others.agg(lambda level: level.value_counts(normalize=True).max()).max())
        return [level for level in scattered if share[level] >= RATIO * usual]
    return [*beyond, *scattered]


def _resolution_mm(used: pd.DataFrame) -> float:
    """Smallest difference of two different readings; 0 if all are equal."""
    steps = np.diff(np.unique(used["measured_mm"].to_numpy(np.float64)))
    return float(steps.min()) if len(steps) else 0.0


def _largest_error_mm(means: pd.Series[float], without: list[float]) -> float:
    """Largest mean error at the other levels; 0 without any."""
    errors = (means - means.index.to_numpy(np.float64)).abs().drop(without)
    return float(errors.max()) if len(errors) else 0.0
