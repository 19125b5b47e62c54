"""Compiled inner loops of the shape fits. Imported only inside functions, because numba takes long to load.

With numpy, a fit of four points is a hundred calls of a microsecond each; compiled it takes a few
microseconds.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.compiled import compiled


@compiled
def invert(matrix: FloatArray, out: FloatArray) -> float:
    """Fill the inverse of a matrix (n, n) by Gauss-Jordan elimination with pivots; overwrites `matrix`.

    Returns:
        log of the absolute determinant; NaN, as the inverse is, of a singular matrix.
    """
    n = len(matrix)
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    log_determinant = 0.0
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        pivot = matrix[best, i]
        if not abs(pivot) > 0.0:
            out[:] = math.nan
            return math.nan
        log_determinant += math.log(abs(pivot))
        for c in range(n):
            matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
            out[i, c], out[best, c] = out[best, c], out[i, c]
        for c in range(n):
            matrix[i, c] /= pivot
            out[i, c] /= pivot
        for r in range(n):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for c in range(n):
                    matrix[r, c] -= factor * matrix[i, c]
                    out[r, c] -= factor * out[i, c]
    return log_determinant


@compiled
def _weigh(
    by_range: FloatArray,
    by_x: FloatArray,
    ranges: FloatArray,
    places: FloatArray,
    cross: FloatArray,
    out: FloatArray,
) -> float:
    """Fill the inverse covariance (n, n) of by_range[i] range[i] + by_x[i] x[i].

    Returns:
        log determinant of that inverse.
    """
    n = len(by_range)
    total = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            total[i, j] = (
                by_range[i] * ranges[i, j] * by_range[j]
                + by_range[i] * cross[i, j] * by_x[j]
                + by_x[i] * cross[j, i] * by_range[j]
                + by_x[i] * places[i, j] * by_x[j]
            )
    return -invert(total, out)


@compiled
def _step(by: FloatArray, weight: FloatArray, covariance: FloatArray, gain: FloatArray) -> None:
    """Fill the covariance (p, p) of least squares with derivatives `by` (n, p), and its gain (p, n)."""
    n, p = by.shape
    weighted, information = np.zeros((p, n)), np.zeros((p, p))
    for i in range(p):
        for k in range(n):
            for m in range(n):
                weighted[i, k] += by[m, i] * weight[m, k]
        for j in range(p):
            for k in range(n):
                information[i, j] += weighted[i, k] * by[k, j]
    invert(information, covariance)
    for i in range(p):
        for k in range(n):
            total = 0.0
            for j in range(p):
                total += covariance[i, j] * weighted[j, k]
            gain[i, k] = total


@compiled
def _times(matrix: FloatArray, vector: FloatArray, out: FloatArray) -> None:
    """Fill the product of a matrix (p, n) and a vector (n,)."""
    for i in range(len(out)):
        total = 0.0
        for k in range(len(vector)):
            total += matrix[i, k] * vector[k]
        out[i] = total


@compiled
def _misfit(residual: FloatArray, weight: FloatArray) -> float:
    """Sum of squared residuals (n,) with weights (n, n)."""
    total = 0.0
    for i in range(len(residual)):
        for j in range(len(residual)):
            total += residual[i] * weight[i, j] * residual[j]
    return total


@compiled
def polynomial(
    x_mm: FloatArray,
    degree: int,
    scale_mm: float,
    range_mm: FloatArray,
    offset_mm: float,
    ranges: FloatArray,
    places: FloatArray,
    cross: FloatArray,
    steps: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float, FloatArray, FloatArray]:
    """Fit of range = sum of coefficients[k] (x / scale)^k; see `fit_polynomials`.

    Returns:
        coefficients (p,), covariance (p, p), derivatives by the ranges (p, n) and by the positions (p, n).
        Chi2 (NaN where the polynomial passes behind the pinhole at a point), depths (n,), and (n, n) inverse
        covariance of the inverse depths.
    """
    n, p = len(x_mm), degree + 1
    powers, slopes = np.ones((n, p)), np.zeros((n, p))
    for i in range(n):
        for k in range(1, p):
            powers[i, k] = powers[i, k - 1] * (x_mm[i] / scale_mm)
            slopes[i, k] = powers[i, k - 1] * (k / scale_mm)
    weight, covariance, gain = ranges.copy(), np.empty((p, p)), np.empty((p, n))
    inverse = np.empty((n, n))
    invert(weight, inverse)
    _step(powers, inverse, covariance, gain)
    coefficients, change = np.empty(p), np.empty(p)
    _times(gain, range_mm, coefficients)
    by, by_range, by_x = np.empty((n, p)), np.empty(n), np.empty(n)
    depth, slope, residual = np.empty(n), np.empty(n), np.empty(n)
    for step in range(steps + 1):
        _times(powers, coefficients, depth)
        _times(slopes, coefficients, slope)
        for i in range(n):
            depth[i] += offset_mm
            measured = 1.0 / (range_mm[i] + offset_mm)
            residual[i] = 1.0 / depth[i] - measured
            by_range[i] = measured * measured
            by_x[i] = -slope[i] * by_range[i]
            for k in range(p):
                by[i, k] = powers[i, k] / (depth[i] * depth[i])  # d(1 / z) = -dz / z^2
        if step == steps:
            break
        _weigh(by_range, by_x, ranges, places, cross, weight)
        _step(by, weight, covariance, gain)
        _times(gain, residual, change)
        coefficients += change
    chi2 = _misfit(residual, weight) if depth.min() > 0.0 else math.nan
    by_place = np.empty((p, n))
    for i in range(n):
        for k in range(p):
            gain[k, i] *= by_range[i]
            by_place[k, i] = -gain[k, i] * slope[i]
    return coefficients, covariance, gain, by_place, chi2, depth, weight


@compiled
def polynomials(
    x_mm: FloatArray,
    count: int,
    scale_mm: float,
    range_mm: FloatArray,
    offset_mm: float,
    ranges: FloatArray,
    places: FloatArray,
    cross: FloatArray,
    steps: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fits of the degrees below `count`; see `PolynomialFits`."""
    n = len(x_mm)
    coefficients, covariance = np.zeros((count, count)), np.zeros((count, count, count))
    by_range, by_place = np.zeros((count, count, n)), np.zeros((count, count, n))
    chi2, depth, weight = np.empty(count), np.empty((count, n)), np.empty((count, n, n))
    for degree in range(count):
        c, v, r, p, misfit, d, w = polynomial(
            x_mm, degree, scale_mm, range_mm, offset_mm, ranges, places, cross, steps
        )
        size = degree + 1
        coefficients[degree, :size], covariance[degree, :size, :size] = c, v
        by_range[degree, :size], by_place[degree, :size] = r, p
        chi2[degree], depth[degree], weight[degree] = misfit, d, w
    return coefficients, covariance, by_range, by_place, chi2, depth, weight


@compiled
def circle_start(x_mm: FloatArray, range_mm: FloatArray, largest: float) -> tuple[float, float, float]:
    """Axis x, axis range, radius of the algebraic fit x^2 + r^2 = 2 a x + 2 b r + c, which is linear.

    Coordinates are relative to the centroid, where c is the mean of the left side. NaN for spots on a line, a
    hollow, and a radius above `largest`.
    """
    n = len(x_mm)
    middle_x, middle_r = x_mm.mean(), range_mm.mean()
    xx = xr = rr = of_x = of_r = squares = 0.0
    for i in range(n):
        x, r = x_mm[i] - middle_x, range_mm[i] - middle_r
        square = x * x + r * r
        xx, xr, rr = xx + x * x, xr + x * r, rr + r * r
        of_x, of_r, squares = of_x + 0.5 * x * square, of_r + 0.5 * r * square, squares + square
    determinant = xx * rr - xr * xr
    if determinant > 1e-12 * xx * rr:
        a, b = (rr * of_x - xr * of_r) / determinant, (xx * of_r - xr * of_x) / determinant
        radius = math.sqrt(squares / n + a * a + b * b)
        if b > 0.0 and radius < largest:
            return a + middle_x, b + middle_r, radius
    return math.nan, math.nan, math.nan


@compiled
def circle(
    start: FloatArray,
    x_mm: FloatArray,
    range_mm: FloatArray,
    ranges: FloatArray,
    places: FloatArray,
    cross: FloatArray,
    steps: int,
    grazing: float,
    largest: float,
) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Fit the circle (axis x, axis range, radius) from `start` (3,); see `fit_cylinder`.

    Returns:
        the circle (3,), covariance (3, 3), derivatives by the ranges (3, n), chi2 (NaN where a point lies on
        the far side or at grazing incidence, or the circle diverges).
        Log density of the ranges without chi2 and powers of 2 pi.
    """
    n = len(x_mm)
    at, step = start.copy(), np.empty(3)
    by, residual = np.empty((n, 3)), np.empty(n)
    along, cosine, weight = np.empty(n), np.empty(n), np.empty((n, n))
    covariance, gain = np.zeros((3, 3)), np.zeros((3, n))
    chi2, log_density = math.nan, math.nan
    for _ in range(steps):
        for i in range(n):
            across, ahead = x_mm[i] - at[0], range_mm[i] - at[1]
            distance = math.hypot(across, ahead)
            along[i], cosine[i] = across / distance, ahead / distance
            residual[i] = distance - at[2]
            by[i, 0], by[i, 1], by[i, 2] = -along[i], -cosine[i], -1.0
        if not cosine.max() < -grazing:
            return at, covariance, gain, math.nan, math.nan
        log_density = 0.5 * _weigh(cosine, along, ranges, places, cross, weight)
        _step(by, weight, covariance, gain)
        chi2 = _misfit(residual, weight)
        _times(gain, residual, step)
        converged = True
        for i in range(n):
            log_density += math.log(-cosine[i])
        for k in range(3):
            converged = converged and abs(step[k]) < 1e-6 * math.sqrt(covariance[k, k])
        if converged:
            break
        for k in range(3):
            at[k] -= step[k]
        if not np.abs(at).max() < largest:
            return at, covariance, gain, math.nan, math.nan
    for i in range(n):
        for k in range(3):
            gain[k, i] *= -cosine[i]
    return at, covariance, gain, chi2, log_density
