"""Polynomial shapes: range over the position along the front, by weighted least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import mul

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.ranging.points import Closest, Points

STEPS = 3
"""Gauss-Newton steps; the linear start differs only by the curvature of inverse depth over the noise. The
loop is compiled (`shape_kernels.polynomial`): a reading has some microseconds for it."""


@dataclass(frozen=True)
class PolynomialFit:
    """range = sum of coefficients[k] (x / scale)^k."""

    coefficients: FloatArray
    """(degree + 1,) mm."""
    covariance: FloatArray
    """(degree + 1, degree + 1) of the coefficients."""
    by_range: FloatArray
    """(degree + 1, n) derivatives by the fitted ranges."""
    by_place: FloatArray
    """(degree + 1, n) derivatives by the positions: an error dx is equivalent to a range error -slope dx."""
    scale_mm: float
    chi2: float
    freedom: int

    @property
    def degree(self) -> int:
        """Degree of the polynomial."""
        return len(self.coefficients) - 1

    def per_mm(self) -> tuple[float, ...]:
        """Coefficients of x^k, mm^(1 - k)."""
        return tuple(c / self.scale_mm**k for k, c in enumerate(self.coefficients.tolist()))

    def closest(self, front_mm: tuple[float, float]) -> Closest:
        """Smallest range over the front.

        Its position depends on the coefficients too, but at a minimum this has no first-order effect.
        """
        places = [*front_mm, *self._turns(front_mm)]
        powers = [[(x / self.scale_mm) ** k for k in range(self.degree + 1)] for x in places]
        ranges = [sum(map(mul, row, self.coefficients.tolist())) for row in powers]
        at = ranges.index(min(ranges))
        by = np.array(powers[at])
        sigma = math.sqrt(by @ self.covariance @ by)
        return Closest(ranges[at], sigma, places[at], by @ self.by_range, by @ self.by_place)

    def _turns(self, front_mm: tuple[float, float]) -> list[float]:
        """Positions inside the front where the slope is 0."""
        if self.degree < 2:
            return []
        slope = self.coefficients[1:] * np.arange(1, self.degree + 1)
        return [x for t in _real_roots(slope) if front_mm[0] < (x := t * self.scale_mm) < front_mm[1]]


@dataclass(frozen=True)
class PolynomialFits:
    """Fits of degrees 0 to D - 1 to the same n spots; arrays padded with zeros beyond each degree."""

    coefficients: FloatArray
    """(D, D)"""
    covariance: FloatArray
    """(D, D, D)"""
    by_range: FloatArray
    """(D, D, n)"""
    by_place: FloatArray
    """(D, D, n)"""
    chi2: FloatArray
    """(D,) NaN where the polynomial passes behind the pinhole or is not determined."""
    depth_mm: FloatArray
    """(D, n)"""
    weight: FloatArray
    """(D, n, n)"""
    scale_mm: float

    def __len__(self) -> int:
        return len(self.chi2)

    def of_degree(self, degree: int) -> PolynomialFit | None:
        """The fit of one degree; None where there is none."""
        chi2, size = float(self.chi2[degree]), degree + 1
        if not math.isfinite(chi2):
            return None
        return PolynomialFit(
            self.coefficients[degree, :size],
            self.covariance[degree, :size, :size],
            self.by_range[degree, :size],
            self.by_place[degree, :size],
            self.scale_mm,
            chi2,
            self.depth_mm.shape[1] - size,
        )


def fit_polynomials(points: Points, count: int) -> PolynomialFits:
    """Maximum-likelihood polynomials of the degrees below `count`.

    Weights are the inverse of the full covariance. Residuals are those of inverse depth, whose deviation does
    not depend on the noise: weights by the measured ranges would favour spots that noise put too near. Errors
    of the positions enter with the slope of the polynomial.
    """
    from workbench.ranging.shape_kernels import polynomials  # loads the compiler

    scale = float(np.abs(points.x_mm).max()) or 1.0
    measured = points.x_mm, count, scale, points.range_mm, points.offset_mm
    return PolynomialFits(*polynomials(*measured, *points.covariances, STEPS), scale)


def _real_roots(coefficients: FloatArray) -> list[float]:
    """Real roots of a polynomial, from its coefficients in rising order."""
    if len(coefficients) > 3:
        roots = np.roots(coefficients[::-1])
        real: list[float] = roots.real[np.abs(roots.imag) <= 1e-9 * (1.0 + np.abs(roots.real))].tolist()
        return real
    c, b, a = (*coefficients.tolist(), 0.0)[:3]
    if a == 0.0:
        return [-c / b] if b != 0.0 else []
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return []
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))  # without cancellation
    return [q / a, c / q] if q != 0.0 else [0.0]
