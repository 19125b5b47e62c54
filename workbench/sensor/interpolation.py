"""Interpolation of a spot's curve along its laser: exact polynomials, or Chebyshev series in an angle.

The argument t of a curve is linear in the inverse depth: inverse depth / unit + t at infinity, both by the
laser. A table has one column for each quantity that is interpolated, and one row for each term.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.lens import LensModel

LEAST_BASELINE_MM = 1e-3
"""Shorter baselines are replaced by this: the spot of such a laser does not move."""
POLYNOMIAL_CHECKS = 5
SERIES_TERMS = (16, 24, 32, 48, 64, 96, 128)
"""Lengths of the Chebyshev series that are tried, the shortest first."""
STARTS = 33
"""Angles from which an inversion may start, 6 degrees apart."""
QUARTER_TURN_RAD = np.pi / 2


class ImageLine(NamedTuple):
    """Lines of L lasers in undistorted coordinates x = X/Z, y = Y/Z, along which their points move."""

    baseline_mm: FloatArray
    """(L,) distance along the line by the inverse depth in 1/mm."""
    at_infinity: FloatArray
    """(L,) place along the line of the point at infinity, from the point nearest to the axis."""
    off_axis: FloatArray
    """(L,) distance of the line from the axis."""


def image_line(rays: FloatArray) -> ImageLine:
    """Lines of rays (L, 4)."""
    origin, direction = rays[:, :2], rays[:, 2:]
    baseline = np.maximum(np.hypot(*origin.T), LEAST_BASELINE_MM)
    along = origin / baseline[:, None]
    at_infinity = (along * direction).sum(axis=1)
    return ImageLine(baseline, at_infinity, np.hypot(*(direction - along * at_infinity[:, None]).T))


class Interpolation(Protocol):
    """Functions of t by their values at nodes; s is the variable in which they are smooth."""

    terms: int

    def scale(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(L,) unit of inverse depth, 1/mm, and (L,) t at infinity, of rays (L, 4)."""
        ...

    @property
    def nodes(self) -> FloatArray:
        """(terms,) s at which values determine a table."""
        ...

    @property
    def checks(self) -> FloatArray:
        """(m,) s between the nodes, at which a table is held against the function."""
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

    def within(self, s: FloatArray) -> FloatArray:
        """(n,) s, moved to where the table holds."""
        ...

    @property
    def starts(self) -> FloatArray:
        """(G,) s in rising order: an inversion starts at one of them."""
        ...


class Polynomial:
    """Powers of t itself: exact for functions that are polynomials of degree `terms` - 1, at any t.

    t is the inverse depth times the laser's baseline: the tangent of the angle between the beam and the line
    of sight, if the beam is parallel to the axis. Few images show spots beyond t = 1.
    """

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

    def within(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return s

    @property
    def starts(self) -> FloatArray:
        """See `Interpolation`. From infinity the first step is the pinhole's exact answer."""
        return np.zeros(1)


class AngleSeries:
    """Chebyshev series in the angle atan(t), s = 1 at 90 degrees.

    The angle is that in the plane through beam and pinhole, from the line of sight nearest to the axis to
    the line of sight of the laser's point. In inverse depth a fisheye's curve bends ever more the nearer the
    target is; in this angle it is all but a straight line, up to targets at no depth (s = 1), whatever the
    beam's tilt. Series of smooth functions converge geometrically (L. N. Trefethen, "Approximation Theory and
    Approximation Practice" (2013), ch. 8).
    """

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
        """See `Interpolation`; in the middle between nodes the error of a series is largest."""
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
        # Imported where it is used: a command on a rig without a fisheye starts 3 ms earlier.
        from numpy.polynomial.chebyshev import chebder

        slope = np.zeros_like(table)
        slope[:, :-1] = chebder(table, axis=1)
        return slope

    def within(self, s: FloatArray) -> FloatArray:
        """See `Interpolation`."""
        return np.clip(s, -1.0, 1.0)

    @property
    def starts(self) -> FloatArray:
        """See `Interpolation`. A step over a wide angle may end beyond the fold of the lens model."""
        return np.linspace(-1.0, 1.0, STARTS)


def interpolations(model: LensModel) -> Iterable[Interpolation]:
    """Those that may hold for the spots of a lens model, the fastest first."""
    if model.polynomial_degree is not None:
        return (Polynomial(model.polynomial_degree + 1),)
    return (AngleSeries(terms) for terms in SERIES_TERMS)
