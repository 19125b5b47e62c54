"""Selection of the shape in front of one line of lasers: the simplest that its ranges do not reject."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.ranging.cylinder import CylinderFit, fit_cylinder
from workbench.ranging.points import Closest, Points, interval_mm, probability
from workbench.ranging.polynomial import PolynomialFit, fit_polynomial

ShapeKind = Literal["flat", "incline", "round", "cylinder", "unknown"]
SIGNIFICANCE = 0.01
"""P value of the residuals below which a shape is rejected; 1 of 100 flat targets is."""
CLEAR_ODDS = 10.0
"""Likelihood ratio from which a cylinder is preferred to a parabola."""


@dataclass(frozen=True)
class ShapeTest:
    """Test of one candidate shape."""

    name: str
    chi2: float
    freedom: int
    probability: float | None
    """P value of `chi2`; None without degrees of freedom."""


@dataclass(frozen=True)
class Shape:
    """Surface in front of one line of lasers; mm, radians, 1 sigma."""

    kind: ShapeKind
    closest_mm: float
    """Smallest range over the front; of an unknown shape, the smallest measured range."""
    closest_sigma_mm: float
    closest_interval_mm: tuple[float, float]
    """95 % interval, given the kind; the upper end may be infinite. Where parabola and circle are not
    distinguished, it covers the intervals of both."""
    closest_x_mm: float
    """Position of the smallest range along the front."""
    closest_by_range: FloatArray
    """(n,) derivatives of `closest_mm` by the ranges."""
    closest_by_place: FloatArray
    """(n,) derivatives of `closest_mm` by the positions of the spots along the front."""
    degree: int | None = None
    """Degree of the polynomial; 0 for a flat, 1 for an incline."""
    coefficients: tuple[float, ...] = ()
    """range = sum of coefficients[k] x^k, x and range in mm."""
    angle_rad: float | None = None
    """Angle of an incline; positive where the surface recedes towards greater x."""
    angle_sigma_rad: float | None = None
    cylinder: CylinderFit | None = None
    """Circle where one fits the points, also where a parabola fits as well."""
    probability: float | None = None
    """P value of the residuals; None without degrees of freedom."""
    tried: tuple[ShapeTest, ...] = ()
    """Tests in the order made; the last is that of the selected shape, or of its rival with as many
    parameters."""


def fit_shape(points: Points, front_mm: tuple[float, float] | None = None) -> Shape:
    """Shape of n spots, n at least 1.

    Candidates are flat, incline, and polynomials of degree 2 (or a circle, which has as many parameters) to
    n - 1; the first that is not rejected is selected. A polynomial of degree n - 1 passes through every point
    and cannot be rejected. The shape is unknown for a single point, and where it reaches back to the sensor.

    Args:
        points: the spots of one line.
        front_mm: ends of the front, over which the closest range is sought; the outermost spots if None.
    """
    front = front_mm or (float(points.x_mm.min()), float(points.x_mm.max()))
    tried: list[ShapeTest] = []
    shape = next(_not_rejected(points, front, tried), None) if len(points) > 1 else None
    if shape is None or shape.closest_mm <= max(0.0, -points.offset_mm):
        return _unknown(points, tuple(tried))
    return replace(shape, tried=tuple(tried))


def _not_rejected(points: Points, front: tuple[float, float], tried: list[ShapeTest]) -> Iterator[Shape]:
    """Shapes that the data do not reject, simplest first; each test is appended to `tried`."""
    for degree in range(len(points)):
        fit = fit_polynomial(points, degree)
        passes = fit is not None and _passes(f"degree {degree}", fit, tried)
        circle = fit_cylinder(points) if degree == 2 else None
        if circle is not None and not _passes("cylinder", circle, tried):
            circle = None
        if circle is not None and (fit is None or not passes or _is_clear(circle, fit)):
            yield _of_cylinder(points, circle, front)
        elif fit is not None and passes:
            yield _of_polynomial(points, fit, circle, front)


def _passes(name: str, fit: PolynomialFit | CylinderFit, tried: list[ShapeTest]) -> bool:
    p = probability(fit.chi2, fit.freedom)
    tried.append(ShapeTest(name, fit.chi2, fit.freedom, p))
    return p is None or p >= SIGNIFICANCE


def _is_clear(circle: CylinderFit, parabola: PolynomialFit) -> bool:
    """Whether the likelihood ratio prefers the circle; both have three parameters, so that it is the odds."""
    return parabola.chi2 - circle.chi2 > 2.0 * math.log(CLEAR_ODDS)


def _of_polynomial(
    points: Points, fit: PolynomialFit, circle: CylinderFit | None, front: tuple[float, float]
) -> Shape:
    kinds: dict[int, ShapeKind] = {0: "flat", 1: "incline"}
    shape = _shape(kinds.get(fit.degree, "round"), fit.closest(front), points)
    if circle is not None:
        nearest, farthest = shape.closest_interval_mm
        rival = _shape("cylinder", circle.closest(front), points).closest_interval_mm
        shape = replace(shape, closest_interval_mm=(min(nearest, rival[0]), max(farthest, rival[1])))
    shape = replace(
        shape,
        degree=fit.degree,
        coefficients=fit.per_mm(),
        cylinder=circle,
        probability=probability(fit.chi2, fit.freedom),
    )
    if fit.degree != 1:
        return shape
    slope = fit.coefficients[1] / fit.scale_mm
    slope_sigma = math.sqrt(fit.covariance[1, 1]) / fit.scale_mm
    return replace(shape, angle_rad=math.atan(slope), angle_sigma_rad=slope_sigma / (1.0 + slope**2))


def _of_cylinder(points: Points, circle: CylinderFit, front: tuple[float, float]) -> Shape:
    shape = _shape("cylinder", circle.closest(front), points)
    return replace(shape, cylinder=circle, probability=probability(circle.chi2, circle.freedom))


def _unknown(points: Points, tried: tuple[ShapeTest, ...]) -> Shape:
    nearest = int(np.argmin(points.range_mm))
    closest = Closest(
        float(points.range_mm[nearest]),
        math.sqrt(points.covariance_mm2[nearest, nearest]),
        float(points.x_mm[nearest]),
        np.eye(len(points))[nearest],
        np.zeros(len(points)),
    )
    return replace(_shape("unknown", closest, points), tried=tried)


def _shape(kind: ShapeKind, closest: Closest, points: Points) -> Shape:
    return Shape(
        kind=kind,
        closest_mm=closest.range_mm,
        closest_sigma_mm=closest.sigma_mm,
        closest_interval_mm=interval_mm(closest.range_mm, closest.sigma_mm, points.offset_mm),
        closest_x_mm=closest.x_mm,
        closest_by_range=closest.by_range,
        closest_by_place=closest.by_place,
    )
