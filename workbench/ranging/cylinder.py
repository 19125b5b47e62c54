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
    from workbench.ranging.shape_kernels import circle  # loads the compiler

    start = _start(points)
    if start is None:
        return None
    try:
        found = circle(start, points.x_mm, points.range_mm, *points.covariances, STEPS, GRAZING, LARGEST_MM)
    except np.linalg.LinAlgError:  # nearly a line: the three parameters are degenerate
        return None
    (x, z, radius), covariance, by_range, chi2, log_density = found
    if not (math.isfinite(chi2) and (np.diag(covariance) > 0).all()):
        return None
    by_place = by_range * ((points.x_mm - x) / (points.range_mm - z))
    fit = CylinderFit(
        float(x), float(z), float(radius), covariance, by_range, by_place, chi2, len(points) - 3, log_density
    )
    return fit if 0 < fit.radius_sigma_mm < MOST_RELATIVE_SIGMA * radius else None


def _start(points: Points) -> FloatArray | None:
    """(3,) axis x, axis range, radius of the algebraic fit x^2 + r^2 = 2 a x + 2 b r + c, which is linear.

    Coordinates are relative to the centroid, where c is the mean of the left side; None for spots on a line.
    """
    middle_x, middle_r = float(points.x_mm.mean()), float(points.range_mm.mean())
    x, r = points.x_mm - middle_x, points.range_mm - middle_r
    square = x * x + r * r
    xx, xr, rr = float(x @ x), float(x @ r), float(r @ r)
    of_x, of_r = 0.5 * float(x @ square), 0.5 * float(r @ square)
    determinant = xx * rr - xr * xr
    if not determinant > 1e-12 * xx * rr:
        return None
    a, b = (rr * of_x - xr * of_r) / determinant, (xx * of_r - xr * of_x) / determinant
    radius = math.sqrt(float(square.mean()) + a * a + b * b)
    return np.array([a + middle_x, b + middle_r, radius]) if b > 0 and radius < LARGEST_MM else None
