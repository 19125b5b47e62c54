"""Polynomial shapes: range over the position along the front, by weighted least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
    depth_mm: FloatArray
    """(n,) fitted depths."""
    weight: FloatArray
    """(n, n) inverse covariance of the inverse depths, errors of the positions included."""

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
        places = np.array([*front_mm, *self._turns(front_mm)])
        powers = _powers(places / self.scale_mm, self.degree)
        ranges = powers @ self.coefficients
        at = int(ranges.argmin())
        sigma = math.sqrt(powers[at] @ self.covariance @ powers[at])
        by = powers[at]
        return Closest(float(ranges[at]), sigma, float(places[at]), by @ self.by_range, by @ self.by_place)

    def _turns(self, front_mm: tuple[float, float]) -> list[float]:
        """Positions inside the front where the slope is 0."""
        if self.degree < 2:
            return []
        slope = self.coefficients[1:] * np.arange(1, self.degree + 1)
        roots = np.roots(slope[::-1])
        real = roots.real[np.abs(roots.imag) <= 1e-9 * (1.0 + np.abs(roots.real))] * self.scale_mm
        return [x for x in real.tolist() if front_mm[0] < x < front_mm[1]]


def fit_polynomial(points: Points, degree: int) -> PolynomialFit | None:
    """Maximum-likelihood polynomial; None where it passes behind the pinhole or is not determined.

    Weights are the inverse of the full covariance. Residuals are those of inverse depth, whose deviation does
    not depend on the noise: weights by the measured ranges would favour spots that noise put too near. Errors
    of the positions enter with the slope of the polynomial.
    """
    from workbench.ranging.shape_kernels import polynomial  # loads the compiler

    scale = float(np.abs(points.x_mm).max()) or 1.0
    measured = points.x_mm, degree, scale, points.range_mm, points.offset_mm
    try:
        coefficients, covariance, by_range, by_place, chi2, depth, weight = polynomial(
            *measured, *points.covariances, STEPS
        )
    except np.linalg.LinAlgError:  # ranges so different that all but a few weights vanish
        return None
    if not math.isfinite(chi2):
        return None
    freedom = len(points) - degree - 1
    return PolynomialFit(coefficients, covariance, by_range, by_place, scale, chi2, freedom, depth, weight)


def _powers(t: FloatArray, degree: int) -> FloatArray:
    """(n, degree + 1) t^0, t^1, ..."""
    return np.asarray(t[:, None] ** np.arange(degree + 1))
