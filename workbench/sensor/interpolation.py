"""Interpolation of spot curves: exact polynomials, or Chebyshev series in an angle.

The argument t of a curve is linear in the inverse depth: inverse depth / unit + t at infinity, with both
constants specific to the laser. A table has one column for each interpolated quantity, and one row for each
term.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.lens import LensModel

LEAST_BASELINE_MM = 1e-3
"""Least baseline; the spot of a laser with a shorter one does not move."""
POLYNOMIAL_CHECKS = 5
SERIES_TERMS = (16, 24, 32, 48, 64, 96, 128)
"""Lengths of the Chebyshev series, tried in this order."""
STARTS = 33
"""Number of starting angles of an inversion, 6 degrees apart."""
QUARTER_TURN_RAD = np.pi / 2


class ImageLine(NamedTuple):
    """Image lines of L lasers in undistorted coordinates x = X/Z, y = Y/Z."""

    baseline_mm: FloatArray
    """(L,) derivative of the position along the line by the inverse depth."""
    at_infinity: FloatArray
    """(L,) position of the vanishing point along the line, from the point nearest to the axis."""
    off_axis: FloatArray
    """(L,) distance of the line from the axis."""


def image_line(rays: FloatArray) -> ImageLine:
    """Image lines of rays (L, 4)."""
    origin, direction = rays[:, :2], rays[:, 2:]
    baseline = np.maximum(np.hypot(*origin.T), LEAST_BASELINE_MM)
    along = origin / baseline[:, None]
    at_infinity = (along * direction).sum(axis=1)
    return ImageLine(baseline, at_infinity, np.hypot(*(direction - along * at_infinity[:, None]).T))


class Interpolation(Protocol):
    """Interpolation of functions of t from values at nodes, in a variable s in which they are smooth."""

    terms: int
    is_series: bool
    """Chebyshev series in an angle, or powers: of the terms, and of the limits of s (-1 to 1, or none)."""

    def scale(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(L,) unit of inverse depth, 1/mm, and (L,) t at infinity, for rays (L, 4)."""
        ...

    @property
    def nodes(self) -> FloatArray:
        """(terms,) s of the nodes."""
        ...

    @property
    def checks(self) -> FloatArray:
        """(m,) s between the nodes, at which a table is compared with the function."""
        ...

    def variable(self, t: FloatArray) -> FloatArray:
        """(n,) s of arguments t (n,)."""
        ...

    def argument(self, s: FloatArray) -> FloatArray:
        """(n,) t of s (n,)."""
        ...

    def argument_slope(self, s: FloatArray) -> FloatArray | float:
        """(n,) dt/ds."""
        ...

    def basis(self, s: FloatArray) -> FloatArray:
        """(n, terms) values of the terms at s (n,)."""
        ...

    def derivative(self, table: FloatArray) -> FloatArray:
        """Table (L, terms, m) of the derivatives by s of the functions of a table (L, terms, m)."""
        ...

    @property
    def starts(self) -> FloatArray:
        """(G,) starting values of an inversion, in rising order."""
        ...


class PolynomialInterpolation:
    """Powers of t: exact at any t for functions that are polynomials of degree `terms` - 1.

    t is the inverse depth times the laser's baseline: for a beam parallel to the axis, the tangent of the
    angle between beam and line of sight. Few images show spots beyond t = 1.
    """

    is_series = False

    def __init__(self, terms: int) -> None:
        self.terms = terms

    def scale(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Interpolation`."""
        return 1.0 / image_line(rays).baseline_mm, np.zeros(len(rays))

    @property
    def nodes(self) -> FloatArray:
        """See `Interpolation`."""
        return np.cos(np.pi * (np.arange(self.terms) + 0.5) / self.terms)

    @property
    def checks(self) -> FloatArray:
        """See `Interpolation`."""
        return np.cos(np.pi * (np.arange(POLYNOMIAL_CHECKS) + 0.3) / POLYNOMIAL_CHECKS)

    def variable(self, t: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return t

    def argument(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return s

    def argument_slope(self, s: FloatArray) -> float:
        """See `Interpolation`."""
        return 1.0

    def basis(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        powers = np.empty((len(s), self.terms))
        powers[:, 0], powers[:, 1:] = 1.0, s[:, None]
        return np.multiply.accumulate(powers, axis=1, out=powers)

    def derivative(self, table: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        slope = np.zeros_like(table)
        slope[:, :-1] = table[:, 1:] * np.arange(1, self.terms)[:, None]
        return slope

    @property
    def starts(self) -> FloatArray:
        """See `Interpolation`. From infinity the first step is exact for a pinhole."""
        return np.zeros(1)


class AngleSeries:
    """Chebyshev series in the angle atan(t), s = 1 at 90 degrees.

    The angle lies in the plane through beam and pinhole, from the line of sight nearest to the axis to that
    of the laser's point. Over inverse depth a fisheye's curve is strongly curved at near targets; over this
    angle it is nearly straight up to depth 0 (s = 1), for any tilt of the beam. Series of analytic functions
    converge geometrically (L. N. Trefethen, "Approximation Theory and Approximation Practice" (2013), ch. 8).
    """

    is_series = True

    def __init__(self, terms: int) -> None:
        self.terms = terms

    def scale(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Interpolation`."""
        line = image_line(rays)
        nearest = np.hypot(1.0, line.off_axis)  # distance of the line from the pinhole
        return nearest / line.baseline_mm, line.at_infinity / nearest

    @property
    def nodes(self) -> FloatArray:
        """See `Interpolation`."""
        return np.cos(np.pi * (np.arange(self.terms) + 0.5) / self.terms)

    @property
    def checks(self) -> FloatArray:
        """See `Interpolation`; midway between nodes the error of a series is largest."""
        return np.cos(np.pi * np.arange(1, self.terms) / self.terms)

    def variable(self, t: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return np.asarray(np.arctan(t) / QUARTER_TURN_RAD)

    def argument(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return np.asarray(np.tan(QUARTER_TURN_RAD * s))

    def argument_slope(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return np.asarray(QUARTER_TURN_RAD * (1.0 + self.argument(s) ** 2))

    def basis(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return np.asarray(np.cos(np.arccos(s)[:, None] * np.arange(self.terms)))

    def derivative(self, table: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        # Imported here: commands on a rig without a fisheye start 3 ms earlier.
        from numpy.polynomial.chebyshev import chebder

        slope = np.zeros_like(table)
        slope[:, :-1] = chebder(table, axis=1)
        return slope

    @property
    def starts(self) -> FloatArray:
        """See `Interpolation`. Several, because a step over a wide angle may end beyond the lens's fold."""
        return np.linspace(-1.0, 1.0, STARTS)


def interpolations(model: LensModel) -> Iterable[Interpolation]:
    """Interpolations to try for the spots of a lens model, the fastest first."""
    if model.polynomial_degree is not None:
        return (PolynomialInterpolation(model.polynomial_degree + 1),)
    return (AngleSeries(terms) for terms in SERIES_TERMS)
