"""Cylinder shape: a circle, the section of a cylinder across the line of lasers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.ranging.points import Closest, Points

STEPS = 12
MOST_RELATIVE_SIGMA = 0.5
"""Largest relative uncertainty of the radius; with more, a circle does not differ from a parabola."""
LARGEST_MM = 1e5
"""Largest axis position and radius. At this radius the surface recedes by 0.02 mm at 60 mm, and the three
parameters are degenerate to rounding."""
GRAZING = 0.1
"""Cosine of the steepest incidence of a spot on the circle."""


@dataclass(frozen=True)
class CylinderFit:
    """Axis and radius, mm; the side that faces the sensor."""

    axis_x_mm: float
    axis_range_mm: float
    radius_mm: float
    covariance: FloatArray
    """(3, 3) of axis position, axis range and radius."""
    by_range: FloatArray
    """(3, n) derivatives by the fitted ranges."""
    by_place: FloatArray
    """(3, n) derivatives by the positions: an error dx is equivalent to a range error -slope dx."""
    chi2: float
    freedom: int
    log_density: float
    """Log density of the ranges without `chi2` and powers of 2 pi."""

    @property
    def radius_sigma_mm(self) -> float:
        """1 sigma of the radius."""
        return math.sqrt(self.covariance[2, 2])

    def closest(self, front_mm: tuple[float, float]) -> Closest:
        """Smallest range over the front."""
        x = min(max(self.axis_x_mm, front_mm[0]), front_mm[1])
        aside = x - self.axis_x_mm
        ahead = math.sqrt(max(self.radius_mm**2 - aside**2, (GRAZING * self.radius_mm) ** 2))
        gradient = np.array([-aside / ahead, 1.0, -self.radius_mm / ahead])
        sigma = math.sqrt(gradient @ self.covariance @ gradient)
        by_range, by_place = gradient @ self.by_range, gradient @ self.by_place
        return Closest(self.axis_range_mm - ahead, sigma, x, by_range, by_place)


def fit_cylinder(points: Points) -> CylinderFit | None:
    """Maximum-likelihood circle, convex towards the sensor; None where the spots determine none.

    Also None where a spot lies at grazing incidence, or the radius is uncertain by more than half. A circle
    has as many parameters as a parabola, and is reported only where it differs from one.
    """
    from workbench.ranging.shape_kernels import circle, circle_start  # loads the compiler

    start = circle_start(points.x_mm, points.range_mm, LARGEST_MM)
    if math.isnan(start[0]):
        return None
    found = circle(
        np.array(start), points.x_mm, points.range_mm, *points.covariances, STEPS, GRAZING, LARGEST_MM
    )
    (x, z, radius), covariance, by_range, chi2, log_density = found
    if not (math.isfinite(chi2) and min(np.diag(covariance).tolist()) > 0):
        return None
    by_place = by_range * ((points.x_mm - x) / (points.range_mm - z))
    fit = CylinderFit(
        float(x), float(z), float(radius), covariance, by_range, by_place, chi2, len(points) - 3, log_density
    )
    return fit if 0 < fit.radius_sigma_mm < MOST_RELATIVE_SIGMA * radius else None
