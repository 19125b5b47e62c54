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
def _inverse(matrix: FloatArray) -> FloatArray:
    inverse = np.empty_like(matrix)
    inverse[:] = np.linalg.inv(matrix)
    return inverse


@compiled
def _weight(
    by_range: FloatArray, by_x: FloatArray, ranges: FloatArray, places: FloatArray, cross: FloatArray
) -> FloatArray:
    """(n, n) inverse covariance of by_range[i] range[i] + by_x[i] x[i]."""
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
    return _inverse(total)


@compiled
def _step(by: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Covariance (p, p) of least squares with derivatives `by` (n, p), and its gain (p, n)."""
    weighted = np.ascontiguousarray(by.T) @ weight
    covariance = _inverse(weighted @ by)
    return covariance, covariance @ weighted


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
    """Fit range = sum of coefficients[k] (x / scale)^k; see `fit_polynomial`.

    Returns:
        coefficients (p,), covariance (p, p), derivatives by the ranges (p, n) and by the positions (p, n).
        Chi2 (NaN where the polynomial passes behind the pinhole at a point), depths (n,), and (n, n) inverse
        covariance of the inverse depths.
    """
    powers, slopes = np.ones((len(x_mm), degree + 1)), np.zeros((len(x_mm), degree + 1))
    for k in range(1, degree + 1):
        powers[:, k] = powers[:, k - 1] * (x_mm / scale_mm)
        slopes[:, k] = powers[:, k - 1] * (k / scale_mm)
    measured = 1.0 / (range_mm + offset_mm)
    by_range = measured * measured
    _, gain = _step(powers, _inverse(ranges))
    coefficients = gain @ range_mm
    weight, covariance = np.zeros_like(ranges), np.zeros_like(ranges)
    for _ in range(steps):
        fitted = 1.0 / (powers @ coefficients + offset_mm)
        weight = _weight(by_range, -(slopes @ coefficients) * by_range, ranges, places, cross)
        by = np.empty_like(powers)
        for i in range(len(powers)):
            by[i] = powers[i] * (fitted[i] * fitted[i])  # d(1 / z) = -dz / z^2
        covariance, gain = _step(by, weight)
        coefficients = coefficients + gain @ (fitted - measured)
    depth = powers @ coefficients + offset_mm
    residual = 1.0 / depth - measured
    chi2 = float(np.sum(residual * (weight @ residual))) if depth.min() > 0.0 else math.nan
    by_coefficient = gain * by_range
    by_place = -by_coefficient * (slopes @ coefficients)
    return coefficients, covariance, by_coefficient, by_place, chi2, depth, weight


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
    at = start.copy()
    by, residual = np.empty((n, 3)), np.empty(n)
    along, cosine = np.empty(n), np.empty(n)
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
        weight = _weight(cosine, along, ranges, places, cross)
        covariance, gain = _step(by, weight)
        chi2 = float(np.sum(residual * (weight @ residual)))
        log_density = 0.5 * np.linalg.slogdet(weight)[1] + np.sum(np.log(-cosine))
        step = gain @ residual
        if np.all(np.abs(step) < 1e-6 * np.sqrt(np.diag(covariance))):
            break
        at = at - step
        if not np.abs(at).max() < largest:
            return at, covariance, gain, math.nan, math.nan
    for i in range(n):
        gain[:, i] *= -cosine[i]
    return at, covariance, gain, chi2, log_density
