"""Shape in front of one line of lasers: the simplest that no other one clearly exceeds in probability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.ranging.cylinder import CylinderFit, fit_cylinder
from workbench.ranging.mixture import Candidate, ShapePosterior, shape_posterior
from workbench.ranging.points import COVERAGE_FACTOR, Points, interval_mm, probabilities
from workbench.ranging.polynomial import PolynomialFit, PolynomialFits, fit_polynomials
from workbench.ranging.shape_prior import CUBIC, ShapePrior

ShapeKind = Literal["flat", "incline", "round", "cylinder", "unknown"]
KINDS: tuple[ShapeKind, ...] = ("flat", "incline", "round", "cylinder")
SIGNIFICANCE = 0.01
"""P value of the residuals of every degree up to 3 below which higher degrees are tried."""
CLEAR_ODDS = 10.0
"""Ratio of probabilities from which a shape is reported instead of a simpler one."""
EXCLUDING_ODDS = 300.0
"""Ratio of probabilities from which the interval of another shape need not include that of a flat."""
CIRCLE = "cylinder"
"""Name of the test of a circle."""
DEFAULT_PRIOR = ShapePrior()


@dataclass(frozen=True)
class ShapeTest:
    """Test of the residuals of one candidate shape."""

    name: str
    chi2: float
    freedom: int
    probability: float | None
    """P value of `chi2`; None without degrees of freedom."""

    @property
    def is_rejected(self) -> bool:
        """Whether the residuals are less likely than `SIGNIFICANCE`."""
        return self.probability is not None and self.probability < SIGNIFICANCE


@dataclass(frozen=True)
class Shape:
    """Surface in front of one line of lasers; mm, radians, 1 sigma."""

    kind: ShapeKind
    closest_mm: float
    """Median of the smallest range over the front, over all shapes; of an unknown one, the smallest range."""
    closest_sigma_mm: float
    closest_interval_mm: tuple[float, float]
    """95 % interval over all shapes; the upper end may be infinite. It includes that of a flat where another
    shape is reported and does not exclude one. Where a laser has no spot, it includes that of the smallest
    measured range."""
    closest_x_mm: float
    """Position of the smallest range along the front, by the reported shape."""
    closest_by_range: FloatArray
    """(n,) derivatives of the reported shape's smallest range by the ranges."""
    closest_by_place: FloatArray
    """(n,) derivatives of the reported shape's smallest range by the positions of the spots."""
    probabilities: Mapping[ShapeKind, float] = field(default_factory=dict)
    """Posterior probability of each kind; empty for a single spot."""
    degree: int | None = None
    """Degree of the polynomial; 0 for a flat, 1 for an incline."""
    coefficients: tuple[float, ...] = ()
    """range = sum of coefficients[k] x^k, x and range in mm."""
    angle_rad: float | None = None
    """Angle of the incline through the spots, for every kind; positive where the surface recedes towards
    greater x; None for a single spot."""
    angle_sigma_rad: float | None = None
    angle_interval_rad: tuple[float, float] | None = None
    """95 % interval of the angle, if the surface is plane."""
    cylinder: CylinderFit | None = None
    """Circle where one fits the points, also where a parabola fits as well."""
    probability: float | None = None
    """P value of the reported shape's residuals; None without degrees of freedom."""
    tried: tuple[ShapeTest, ...] = ()
    """Tests of the polynomials by degree, and of the circle."""


class _Angle(NamedTuple):
    angle_rad: float | None = None
    sigma_rad: float | None = None
    interval_rad: tuple[float, float] | None = None


def fit_shape(
    points: Points,
    front_mm: tuple[float, float] | None = None,
    prior: ShapePrior = DEFAULT_PRIOR,
    lasers: int | None = None,
) -> Shape:
    """Shape of n spots, n at least 1.

    Candidates are flat, incline, parabola, circle, cubic, and polynomials to degree n - 1 where these are
    rejected. The reported shape is the simplest with at least 1 / `CLEAR_ODDS` of the largest probability.
    The closest range and its interval are those of the mixture of all shapes. The shape is unknown for a
    single spot, and where the reported one reaches back to the sensor.

    Args:
        points: the spots of one line.
        front_mm: ends of the front, over which the closest range is sought; the outermost spots if None.
        prior: prior over shapes and sizes.
        lasers: number of lasers of the line, with or without a spot; None: as many as spots. Shapes that
            this number of spots would not determine are left out.
    """
    front = front_mm or (float(points.x_mm.min()), float(points.x_mm.max()))
    if not front[1] > front[0]:
        return _unknown(points, None, _Angle(), ())
    fits, circle, tried = _fits(points)
    angle = _angle(fits.of_degree(1) if len(fits) > 1 else None)
    seen, possible = _posteriors(points, front, (fits, circle), prior, lasers or len(points))
    if seen is None or possible is None:
        return _unknown(points, possible, angle, tried)
    kind, degree = _reported(seen)
    fit, name = (circle, CIRCLE) if kind == "cylinder" else (fits.of_degree(degree), _name(degree))
    if fit is None or (closest := fit.closest(front)).range_mm <= max(0.0, -points.offset_mm):
        return _unknown(points, possible, angle, tried)
    by_kind = _by_kind(seen)
    return Shape(
        kind=kind,
        closest_mm=seen.median_mm,
        closest_sigma_mm=possible.deviation_mm(seen.median_mm),
        closest_interval_mm=_interval_mm(points, (seen, possible), kind, by_kind, fits),
        closest_x_mm=closest.x_mm,
        closest_by_range=closest.by_range,
        closest_by_place=closest.by_place,
        probabilities=by_kind,
        degree=None if isinstance(fit, CylinderFit) else degree,
        coefficients=() if isinstance(fit, CylinderFit) else fit.per_mm(),
        angle_rad=angle.angle_rad,
        angle_sigma_rad=angle.sigma_rad,
        angle_interval_rad=angle.interval_rad,
        cylinder=circle,
        probability=next(test.probability for test in tried if test.name == name),
        tried=tried,
    )


def _fits(points: Points) -> tuple[PolynomialFits, CylinderFit | None, tuple[ShapeTest, ...]]:
    """Polynomials by degree, circle, and their tests; degrees above 3 where all others are rejected."""
    degrees = min(len(points), CUBIC + 1)
    fits = fit_polynomials(points, degrees)
    circle = fit_cylinder(points) if len(points) > 2 else None
    tests = _tests(fits, circle)
    if len(points) > degrees and all(test.is_rejected for test in tests):
        fits = fit_polynomials(points, len(points))
        tests = _tests(fits, circle)
    return fits, circle, tests


def _tests(fits: PolynomialFits, circle: CylinderFit | None) -> tuple[ShapeTest, ...]:
    n = fits.depth_mm.shape[1]
    tested = [(_name(degree), chi2, n - degree - 1) for degree, chi2 in enumerate(fits.chi2.tolist())]
    if circle is not None:
        tested.append((CIRCLE, circle.chi2, circle.freedom))
    tested = [one for one in tested if math.isfinite(one[1])]
    p_values = probabilities([chi2 for _, chi2, _ in tested], [freedom for _, _, freedom in tested])
    return tuple(ShapeTest(*one, p_value) for one, p_value in zip(tested, p_values, strict=True))


def _name(degree: int) -> str:
    """Name of the test of a polynomial."""
    return f"degree {degree}"


def _posteriors(
    points: Points,
    front: tuple[float, float],
    fits: tuple[PolynomialFits, CylinderFit | None],
    prior: ShapePrior,
    lasers: int,
) -> tuple[ShapePosterior | None, ShapePosterior | None]:
    """Posteriors over the shapes that the spots determine, and over those that all lasers would determine."""
    polynomials, circle = fits
    known = len(polynomials) - 1
    highest = max(known, min(CUBIC, lasers - 1))
    seen = shape_posterior(points, front, polynomials, circle, prior, known) if known else None
    if highest == known:
        return seen, seen
    return seen, shape_posterior(points, front, polynomials, circle, prior, highest)


def _reported(posterior: ShapePosterior) -> Candidate:
    """Simplest candidate that no other exceeds by `CLEAR_ODDS`."""
    least = max(posterior.probabilities.values()) / CLEAR_ODDS
    return next(one for one, p in posterior.probabilities.items() if p >= least)


def _interval_mm(
    points: Points,
    posteriors: tuple[ShapePosterior, ShapePosterior],
    kind: ShapeKind,
    by_kind: Mapping[ShapeKind, float],
    fits: PolynomialFits,
) -> tuple[float, float]:
    """Interval over all shapes, see `Shape.closest_interval_mm`."""
    seen, possible = posteriors
    intervals = [possible.interval_mm]
    if possible is not seen:
        intervals.append(_nearest_interval_mm(points))
    if kind != "flat" and EXCLUDING_ODDS * by_kind["flat"] >= by_kind[kind]:
        flat = fits.of_degree(0)
        if flat is not None:
            at, sigma = float(flat.coefficients[0]), math.sqrt(flat.covariance[0, 0])
            intervals.append(interval_mm(at, sigma, points.offset_mm))
    return min(low for low, _ in intervals), max(high for _, high in intervals)


def _nearest_interval_mm(points: Points) -> tuple[float, float]:
    """Interval of the smallest measured range."""
    nearest = int(np.argmin(points.range_mm))
    at, sigma = points.range_mm[nearest], math.sqrt(points.covariance_mm2[nearest, nearest])
    return interval_mm(float(at), sigma, points.offset_mm)


def _by_kind(posterior: ShapePosterior) -> dict[ShapeKind, float]:
    found = dict.fromkeys(KINDS, 0.0)
    for (kind, _), probability in posterior.probabilities.items():
        found[kind] += probability
    return found


def _angle(incline: PolynomialFit | None) -> _Angle:
    """Angle of an incline; its interval is that of the slope, which is Gaussian."""
    if incline is None:
        return _Angle()
    _, slope = incline.per_mm()
    sd = math.sqrt(incline.covariance[1, 1]) / incline.scale_mm
    low, high = (math.atan(slope + side * COVERAGE_FACTOR * sd) for side in (-1.0, 1.0))
    return _Angle(math.atan(slope), 0.5 * (math.atan(slope + sd) - math.atan(slope - sd)), (low, high))


def _unknown(
    points: Points, posterior: ShapePosterior | None, angle: _Angle, tried: tuple[ShapeTest, ...]
) -> Shape:
    """The smallest measured range; its interval includes that over all shapes, if there is one."""
    nearest = int(np.argmin(points.range_mm))
    at, sigma = float(points.range_mm[nearest]), math.sqrt(points.covariance_mm2[nearest, nearest])
    low, high = _nearest_interval_mm(points)
    if posterior is not None:
        low, high = min(low, posterior.interval_mm[0]), max(high, posterior.interval_mm[1])
    return Shape(
        kind="unknown",
        closest_mm=at,
        closest_sigma_mm=sigma,
        closest_interval_mm=(low, high),
        closest_x_mm=float(points.x_mm[nearest]),
        closest_by_range=np.eye(len(points))[nearest],
        closest_by_place=np.zeros(len(points)),
        angle_rad=angle.angle_rad,
        angle_sigma_rad=angle.sigma_rad,
        angle_interval_rad=angle.interval_rad,
        tried=tried,
    )
