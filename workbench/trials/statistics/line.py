"""Straight line through points with errors in both coordinates.

Source: York, Evensen, Lopez Martinez and De Basabe Delgado, Unified equations for the slope, intercept, and
standard errors of the best straight line, American Journal of Physics 72 (2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import require

MOST_STEPS = 500
TOLERANCE = 1e-14
"""Relative change of the slope at which the iteration ends."""


@dataclass(frozen=True)
class LineFit:
    """Line y = intercept + slope x."""

    slope: float
    intercept: float
    covariance: FloatArray
    """(2, 2) covariance of slope and intercept for the stated standard deviations."""
    chi2: float
    degrees_of_freedom: int


def fit_line(x: FloatArray, y: FloatArray, x_sd: FloatArray, y_sd: FloatArray) -> LineFit:
    """Fit a straight line by York's equations, errors of x and y independent.

    Args:
        x: (n,) abscissae, any unit.
        y: (n,) ordinates, any unit.
        x_sd: (n,) standard deviations of x; zeros: exact.
        y_sd: (n,) standard deviations of y, above 0.

    Raises:
        TooFewReadingsError: fewer than two points.
        ValueError: all x are equal, or the iteration does not converge.
    """
    require(len(x), 2, "points")
    if not np.ptp(x) > 0:
        raise ValueError("expected different x, got one value")
    slope = float(np.polyfit(x - x.mean(), y, 1)[0])
    for _ in range(MOST_STEPS):
        before, weights = slope, 1 / (y_sd**2 + slope**2 * x_sd**2)
        u, v = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
        adjusted = weights * (u * y_sd**2 + slope * v * x_sd**2)
        slope = float((weights * adjusted) @ v / ((weights * adjusted) @ u))
        if abs(slope - before) <= TOLERANCE * max(abs(slope), abs(before)):
            return _line(x, y, slope, weights, adjusted)
    raise ValueError(f"expected convergence of the slope in {MOST_STEPS} steps, got {before} and {slope}")


def _line(x: FloatArray, y: FloatArray, slope: float, weights: FloatArray, adjusted: FloatArray) -> LineFit:
    """Intercept, covariance and chi2 of a line with a known slope; `adjusted`: York's beta."""
    x_mean = float(np.average(x, weights=weights))
    intercept = float(np.average(y, weights=weights)) - slope * x_mean
    center = x_mean + float(np.average(adjusted, weights=weights))
    spread = float(weights @ (x_mean + adjusted - center) ** 2)
    slope_variance = 1 / spread
    residuals = y - intercept - slope * x
    return LineFit(
        slope,
        intercept,
        np.array(
            [
                [slope_variance, -center * slope_variance],
                [-center * slope_variance, 1 / float(weights.sum()) + center**2 * slope_variance],
            ]
        ),
        float(weights @ residuals**2),
        len(x) - 2,
    )
