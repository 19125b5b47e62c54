"""A circle through spots: the section of a cylinder that stands across the line of lasers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.ranging.points import Closest, Points

FloatArray = NDArray[np.float64]
STEPS = 12
MOST_RELATIVE_SIGMA = 0.5
"""A radius known worse tells nothing that a parabola does not."""
GRAZING = 0.1
"""Cosine of the steepest incidence at which a spot is believed to lie on a circle."""


@dataclass(frozen=True)
class CylinderFit:
    """Axis and radius, mm; the side that faces the sensor."""

    axis_x_mm: float
    axis_range_mm: float
    radius_mm: float
    covariance: FloatArray
    """(3, 3) of the three."""
    by_range: FloatArray
    """(3, n) their derivatives by the ranges that were fitted."""
    chi2: float
    freedom: int

    @property
    def radius_sigma_mm(self) -> float:
        """1 sigma."""
        return math.sqrt(self.covariance[2, 2])

    def closest(self, front_mm: tuple[float, float]) -> Closest:
        """Smallest range over the front."""
        x = min(max(self.axis_x_mm, front_mm[0]), front_mm[1])
        aside = x - self.axis_x_mm
        ahead = math.sqrt(max(self.radius_mm**2 - aside**2, (GRAZING * self.radius_mm) ** 2))
        gradient = np.array([-aside / ahead, 1.0, -self.radius_mm / ahead])
        sigma = math.sqrt(gradient @ self.covariance @ gradient)
        return Closest(self.axis_range_mm - ahead, sigma, x, gradient @ self.by_range)


def fit_cylinder(points: Points) -> CylinderFit | None:
    """Maximum-likelihood circle, bulging towards the sensor; None where there is none to speak of.

    None too where a spot would lie at grazing incidence or the radius would hardly be known: with as many
    parameters as a parabola, a circle is worth telling only where it differs from one.
    """
    circle = _start(points)
    if circle is None:
        return None
    for _ in range(STEPS):
        along, cosine, distance = _seen_from(circle, points)
        if not (cosine < -GRAZING).all():
            return None
        weight = np.linalg.inv(points.residual_covariance(cosine, along))
        by = np.column_stack((-along, -cosine, -np.ones(len(points))))
        weighted = by.T @ weight
        covariance = np.linalg.inv(weighted @ by)
        gain = covariance @ weighted
        step = gain @ (distance - circle[2])
        circle = circle - step
        if not np.abs(circle).max() < 1e6:
            return None
        if (np.abs(step) < 1e-6 * np.sqrt(np.diag(covariance))).all():
            break
    along, cosine, distance = _seen_from(circle, points)
    residual = distance - circle[2]
    x, z, radius = circle.tolist()
    chi2 = float(residual @ weight @ residual)
    by_range = np.asarray(-gain * cosine, np.float64)
    fit = CylinderFit(x, z, radius, np.asarray(covariance, np.float64), by_range, chi2, len(points) - 3)
    believed = (cosine < -GRAZING).all() and 0 < fit.radius_sigma_mm < MOST_RELATIVE_SIGMA * radius
    return fit if believed else None


def _start(points: Points) -> FloatArray | None:
    """(3,) axis x, axis range, radius of the circle x^2 + r^2 = 2 a x + 2 b r + c: linear, not the best."""
    x, r = points.x_mm, points.range_mm
    middle = float(r.mean())
    d = r - middle
    a, b, c = np.linalg.lstsq(np.column_stack((2 * x, 2 * d, np.ones(len(x)))), x**2 + d**2, rcond=None)[0]
    square = c + a * a + b * b
    if not (square > 0 and b > 0):
        return None
    return np.array([a, b + middle, math.sqrt(square)])


def _seen_from(circle: FloatArray, points: Points) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Direction from the axis to each spot (its x and its range component), and distance; each (n,)."""
    x, r = points.x_mm - circle[0], points.range_mm - circle[1]
    distance = np.hypot(x, r)
    return x / distance, r / distance, distance
