"""Linearity of ranges: deviation from the best line and from the line of identity (IEC 61298-2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import require

PERCENT = 100.0


@dataclass(frozen=True)
class Linearity:
    """Linearity over a full scale; deviations in mm."""

    independent_mm: float
    """Largest deviation from the line that makes it smallest."""
    absolute_mm: float
    """Largest deviation from the line of identity, measured = true."""
    slope: float
    """Slope of the least-squares line, measured over true; without unit."""
    intercept_mm: float
    """Measured range of the least-squares line at true range 0, mm."""
    rms_mm: float
    """Root mean square of the residuals from the least-squares line (n - 2 degrees of freedom), mm."""
    full_scale_mm: float
    """Largest - smallest true range, unless the caller states the sensor's span."""
    n: int
    """Number of true ranges."""

    @property
    def independent_percent(self) -> float:
        """Independent linearity in % of full scale."""
        return PERCENT * self.independent_mm / self.full_scale_mm

    @property
    def absolute_percent(self) -> float:
        """Absolute linearity in % of full scale."""
        return PERCENT * self.absolute_mm / self.full_scale_mm


def linearity(true_mm: FloatArray, measured_mm: FloatArray) -> Linearity:
    """Linearity of mean readings (n,) at different true ranges (n,), mm.

    Raises:
        TooFewReadingsError: fewer than three true ranges.
    """
    require(len(np.unique(true_mm)), 3, "different true ranges")
    middle, span = float(true_mm.mean()), float(np.ptp(true_mm))
    error, x = measured_mm - true_mm, (true_mm - middle) / span
    tilt, offset = np.polyfit(x, error, 1)
    residuals = error - tilt * x - offset
    slope = 1 + float(tilt) / span
    return Linearity(
        independent_mm=_smallest_largest_deviation(x, error),
        absolute_mm=float(np.abs(error).max()),
        slope=slope,
        intercept_mm=float(offset) + (1 - slope) * middle,
        rms_mm=float(np.sqrt(residuals @ residuals / (len(x) - 2))),
        full_scale_mm=span,
        n=len(x),
    )


def _smallest_largest_deviation(x: FloatArray, y: FloatArray) -> float:
    """Minimum over all lines of the largest abs(y - line(x)), as a linear program."""
    scale = float(np.abs(y).max()) or 1.0
    ones = np.ones(len(x))
    above = np.column_stack([x, ones, -ones])
    below = np.column_stack([-x, -ones, -ones])
    found = linprog(
        [0, 0, 1],
        A_ub=np.vstack([above, below]),
        b_ub=np.concatenate([y, -y]) / scale,
        bounds=[(None, None), (None, None), (0, None)],
    )
    return float(np.asarray(found.x, np.float64)[2]) * scale
