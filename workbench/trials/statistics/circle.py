"""Geometric fit of a circle to points of a plane: least squares of the distances from the circle.

Source: Gander, Golub and Strebel, Least-squares fitting of circles and ellipses, BIT 34 (1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import require


@dataclass(frozen=True)
class CircleFit:
    """Fitted circle."""

    center_mm: tuple[float, float]
    radius_mm: float
    covariance: FloatArray
    """(3, 3) covariance of center x, center y and radius, mm2."""
    rms_mm: float
    """Root mean square of the distances from the circle, mm."""


def fit_circle(points_mm: FloatArray, sd_mm: float | None = None) -> CircleFit:
    """Fit a circle to points (n, 2) in mm, with the covariance to first order.

    Args:
        points_mm: (n, 2) points.
        sd_mm: standard deviation of each coordinate, mm; None: estimated from the residuals (n - 3 degrees of
            freedom).

    Raises:
        TooFewReadingsError: fewer than 3 points, or 3 without `sd_mm`.
        ValueError: the points lie on a line.
    """
    require(len(points_mm), 3 if sd_mm is not None else 4, "points")
    middle = points_mm.mean(axis=0)
    local = points_mm - middle
    size = float(np.abs(local).max())
    if np.linalg.matrix_rank(local, tol=1e-9 * size) < 2:
        raise ValueError("expected points on a circle, got points on a line")
    start = _algebraic_circle(local / size)
    found = least_squares(_distances, start, jac=_jacobian, args=(local / size,), method="lm", xtol=1e-14)
    x, y, radius = found.x * size
    jac = _jacobian(found.x, local / size)
    chi2 = float(found.fun @ found.fun) * size**2
    variance = sd_mm**2 if sd_mm is not None else chi2 / (len(points_mm) - 3)
    return CircleFit(
        (float(x + middle[0]), float(y + middle[1])),
        float(radius),
        np.asarray(np.linalg.inv(jac.T @ jac) * variance, np.float64),
        float(np.sqrt(chi2 / len(points_mm))),
    )


def _algebraic_circle(points: FloatArray) -> FloatArray:
    """Circle (x, y, radius) that minimises the algebraic distance (Kasa), as a start."""
    design = np.column_stack([2 * points, np.ones(len(points))])
    x, y, c = np.linalg.lstsq(design, (points**2).sum(axis=1), rcond=None)[0]
    return np.array([x, y, np.sqrt(c + x**2 + y**2)])


def _distances(circle: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(points - circle[:2]).T) - circle[2], np.float64)


def _jacobian(circle: FloatArray, points: FloatArray) -> FloatArray:
    away = points - circle[:2]
    return np.column_stack([-away / np.hypot(*away.T)[:, None], -np.ones(len(points))])
