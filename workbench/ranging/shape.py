"""The shape before one line of lasers: the simplest that its ranges do not reject."""

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

Kind = Literal["flat", "incline", "round", "cylinder", "unknown"]
SIGNIFICANCE = 0.01
"""A shape is rejected when its residuals are less likely than this: one flat in a hundred is."""
CLEAR_ODDS = 10.0
"""A cylinder is told from a parabola where the data make it so many times more likely."""


@dataclass(frozen=True)
class Tried:
    """How one shape fared."""

    name: str
    chi2: float
    freedom: int
    probability: float | None
    """Of a chi2 at least as large if the shape is true; None where no freedom is left to test it with."""


@dataclass(frozen=True)
class Shape:
    """What stands before one line of lasers; mm, radians, 1 sigma."""

    kind: Kind
    closest_mm: float
    """Smallest range over the front; of a shape that is not known, the smallest range measured."""
    closest_sigma_mm: float
    closest_interval_mm: tuple[float, float]
    """95 % if the shape is the one told; the upper end may be infinite. Where a parabola and a circle cannot
    be told apart, it spans both of theirs."""
    closest_x_mm: float
    """Where on the front."""
    closest_by_range: FloatArray
    """(n,) derivatives of `closest_mm` by the ranges."""
    closest_by_place: FloatArray
    """(n,) and by the places of the spots along the front."""
    degree: int | None = None
    """Of the polynomial; 0 for a flat, 1 for an incline."""
    coefficients: tuple[float, ...] = ()
    """range = sum of coefficients[k] x^k, x and range in mm."""
    angle_rad: float | None = None
    """Of an incline; positive where the surface recedes towards greater x."""
    angle_sigma_rad: float | None = None
    cylinder: CylinderFit | None = None
    """Where a circle fits the points, also when a parabola does as well."""
    probability: float | None = None
    """Of residuals at least as large as found, if the shape is true; None where nothing was left to test."""
    tried: tuple[Tried, ...] = ()
    """In the order of trial; the one that was taken, if any, is the last but for a rival of its size."""


def fit_shape(points: Points, front_mm: tuple[float, float] | None = None) -> Shape:
    """Shape of n spots, n at least 1.

    Flat, incline, polynomial of degree 2 (or a circle, which has as many parameters) up to n - 1: the first
    whose residuals are not improbable. A polynomial of degree n - 1 passes through every point and cannot be
    rejected. One point tells no shape, nor does a shape that reaches back to the sensor.

    Args:
        points: the spots of one line.
        front_mm: from where to where on the front the closest range is sought; the outermost spots if None.
    """
    front = front_mm or (float(points.x_mm.min()), float(points.x_mm.max()))
    tried: list[Tried] = []
    shape = next(_not_rejected(points, front, tried), None) if len(points) > 1 else None
    if shape is None or shape.closest_mm <= max(0.0, -points.offset_mm):
        return _unknown(points, tuple(tried))
    return replace(shape, tried=tuple(tried))


def _not_rejected(points: Points, front: tuple[float, float], tried: list[Tried]) -> Iterator[Shape]:
    """Shapes that the data do not reject, simplest first; tells in `tried` how each fared."""
    for degree in range(len(points)):
        fit = fit_polynomial(points, degree)
        stands = fit is not None and _stands(f"degree {degree}", fit, tried)
        circle = fit_cylinder(points) if degree == 2 else None
        if circle is not None and not _stands("cylinder", circle, tried):
            circle = None
        if circle is not None and (fit is None or not stands or _is_clear(circle, fit)):
            yield _of_cylinder(points, circle, front)
        elif fit is not None and stands:
            yield _of_polynomial(points, fit, circle, front)


def _stands(name: str, fit: PolynomialFit | CylinderFit, tried: list[Tried]) -> bool:
    chance = probability(fit.chi2, fit.freedom)
    tried.append(Tried(name, fit.chi2, fit.freedom, chance))
    return chance is None or chance >= SIGNIFICANCE


def _is_clear(circle: CylinderFit, parabola: PolynomialFit) -> bool:
    """Both have three parameters, so that the odds are the ratio of their likelihoods."""
    return parabola.chi2 - circle.chi2 > 2.0 * math.log(CLEAR_ODDS)


def _of_polynomial(
    points: Points, fit: PolynomialFit, circle: CylinderFit | None, front: tuple[float, float]
) -> Shape:
    kinds: dict[int, Kind] = {0: "flat", 1: "incline"}
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


def _unknown(points: Points, tried: tuple[Tried, ...]) -> Shape:
    nearest = int(np.argmin(points.range_mm))
    closest = Closest(
        float(points.range_mm[nearest]),
        math.sqrt(points.covariance_mm2[nearest, nearest]),
        float(points.x_mm[nearest]),
        np.eye(len(points))[nearest],
        np.zeros(len(points)),
    )
    return replace(_shape("unknown", closest, points), tried=tried)


def _shape(kind: Kind, closest: Closest, points: Points) -> Shape:
    return Shape(
        kind=kind,
        closest_mm=closest.range_mm,
        closest_sigma_mm=closest.sigma_mm,
        closest_interval_mm=interval_mm(closest.range_mm, closest.sigma_mm, points.offset_mm),
        closest_x_mm=closest.x_mm,
        closest_by_range=closest.by_range,
        closest_by_place=closest.by_place,
    )
