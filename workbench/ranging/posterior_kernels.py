"""Compiled posterior over shapes. Imported only inside functions, because numba takes long to load."""

from __future__ import annotations

import math

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.ranging.mixture_kernels import posterior, quantiles
from workbench.ranging.shape_kernels import invert
from workbench.spots.kernels.compiled import compiled


@compiled
def circle_log_density(
    axis_x_mm: float,
    radius_mm: float,
    middle_mm: float,
    half_mm: float,
    mean: FloatArray,
    sd: FloatArray,
    circle_mass: FloatArray,
) -> float:
    """Log prior density of a circle by axis position and radius, mm^-2: that of its parabola at the apex.

    A circle of radius R about x has the curvature 1 / (2 R) and, in the middle of the front, the slope of
    a parabola with its apex at x. The last five arguments are those of `PriorComponents`.
    """
    aside = (axis_x_mm - middle_mm) / half_mm
    curvature = 0.5 * half_mm * half_mm / radius_mm
    density = 0.0
    for c in range(len(circle_mass)):
        if circle_mass[c] > 0.0:
            by_slope = -2.0 * curvature * aside / sd[c, 0]
            by_curvature = (curvature - mean[c, 1]) / sd[c, 1]
            peak = circle_mass[c] / (2.0 * math.pi * sd[c, 0] * sd[c, 1])
            density += peak * math.exp(-0.5 * (by_slope * by_slope + by_curvature * by_curvature))
    density *= (curvature / radius_mm) * (2.0 * curvature / half_mm)
    return math.log(density) if density > 0.0 else -math.inf


@compiled
def _fill_estimate(coefficients: FloatArray, start: float, step: float, out: FloatArray) -> None:
    """Fill the coefficients (size,) of powers of t of sum of coefficients[k] (start + step t)^k."""
    out[:] = 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        for j in range(len(coefficients) - 1, 0, -1):
            out[j] = out[j] * start + out[j - 1] * step
        out[0] = out[0] * start + coefficients[k]


@compiled
def shape_mixture(
    x_mm: FloatArray,
    range_mm: FloatArray,
    offset_mm: float,
    coefficients: FloatArray,
    depth_mm: FloatArray,
    weight: FloatArray,
    chi2: FloatArray,
    scale_mm: float,
    circle: tuple[float, float, float, float, float, float],
    circle_covariance: FloatArray,
    middle_mm: float,
    half_mm: float,
    degree: IndexArray,
    log_mass: FloatArray,
    mean: FloatArray,
    sd: FloatArray,
    log_parabola: FloatArray,
    circle_mass: FloatArray,
    nodes: FloatArray,
    counts: IndexArray,
    floor: float,
    levels: FloatArray,
) -> tuple[bool, FloatArray, FloatArray]:
    """Posterior over shapes, see `mixture.shape_posterior`.

    Args:
        x_mm: (n,) positions of the spots.
        range_mm: (n,) their ranges.
        offset_mm: depth = range + offset.
        coefficients: (D, D) as in `PolynomialFits`, like the next four arguments. Degrees of the prior from D
            on, which the spots do not determine, have the last fit.
        depth_mm: (D, n).
        weight: (D, n, n).
        chi2: (D,)
        scale_mm: unit of the position.
        circle: axis x, radius, chi2 (NaN where there is no circle), log density of the ranges, closest range
            and its deviation.
        circle_covariance: (3, 3) as in `CylinderFit`.
        middle_mm: as in `PriorComponents`, like the next seven arguments; H is the highest degree.
        half_mm: half of the front.
        degree: (C,)
        log_mass: (C,)
        mean: (C, H)
        sd: (C, H)
        log_parabola: (C,)
        circle_mass: (C,)
        nodes: (H + 1, M, H) as in `posterior`.
        counts: (H + 1,) as in `posterior`.
        floor: smallest possible range, mm.
        levels: (3,) probabilities of the quantiles.

    Returns:
        Whether a shape before the floor agrees with the spots. (H + 2,) probability of each degree, and last
        that of circles. (5,) quantiles of the closest range, its mean, its standard deviation, mm.
    """
    known, size, n = len(chi2), mean.shape[1] + 1, len(x_mm)
    estimate, misfit = np.zeros((size, size)), np.empty(size)
    depths, weights = np.empty((size, n)), np.empty((size, n, n))
    for d in range(size):
        of = min(d, known - 1)
        _fill_estimate(
            coefficients[of, : of + 1], middle_mm / scale_mm, half_mm / scale_mm, estimate[d, : of + 1]
        )
        misfit[d], depths[d], weights[d] = chi2[of], depth_mm[of], weight[of]
    axis_x_mm, radius_mm, circle_chi2, log_density, nearest_mm, nearest_sd_mm = circle
    has_circle = math.isfinite(circle_chi2)
    t = (x_mm - middle_mm) / half_mm
    mass = log_mass + log_parabola if has_circle else log_mass
    evidence, closest, share, own = posterior(
        t, estimate, depths, weights, misfit, degree, mass, mean, sd, nodes, counts, floor
    )
    circle_evidence = -math.inf
    if has_circle and nearest_mm > floor:
        # Laplace's method about the fit. The polynomials' density is that of inverse depths: d(1/z) = dz/z^2.
        circle_evidence = circle_log_density(axis_x_mm, radius_mm, middle_mm, half_mm, mean, sd, circle_mass)
        log_determinant = invert(circle_covariance.copy(), np.empty((3, 3)))
        circle_evidence += math.log(2.0 * math.pi) + 0.5 * log_determinant + log_density - 0.5 * circle_chi2
        for i in range(n):
            circle_evidence += 2.0 * math.log(range_mm[i] + offset_mm)
    added = circle_evidence, nearest_mm, nearest_sd_mm
    return _mixed(evidence, closest, share, own, degree, added, offset_mm, levels)


@compiled
def _mixed(
    evidence: FloatArray,
    closest: FloatArray,
    share: FloatArray,
    own: FloatArray,
    degree: IndexArray,
    circle: tuple[float, float, float],
    offset_mm: float,
    levels: FloatArray,
) -> tuple[bool, FloatArray, FloatArray]:
    """Results of `shape_mixture` from those of `posterior`, and a circle: log evidence, closest range, sd."""
    by_shape, found = np.zeros(degree.max() + 2), np.empty(5)
    best = max(evidence.max(), circle[0])
    if not math.isfinite(best):
        return False, by_shape, found
    range_mm, sd_mm, weight = np.empty(share.size + 1), np.empty(share.size + 1), np.empty(share.size + 1)
    m, total = 0, 0.0
    for c in range(len(evidence)):
        mass = math.exp(evidence[c] - best)
        by_shape[degree[c]] += mass
        for k in range(share.shape[1]):
            if share[c, k] * mass > 0.0:
                range_mm[m], sd_mm[m], weight[m] = closest[c, k], own[c], share[c, k] * mass
                total += weight[m]
                m += 1
    mass = math.exp(circle[0] - best)
    by_shape[-1] = mass
    if mass > 0.0:
        range_mm[m], sd_mm[m], weight[m] = circle[1], circle[2], mass
        total += mass
        m += 1
    if m == 0:
        return False, by_shape, found
    range_mm, sd_mm, weight = range_mm[:m], sd_mm[:m], weight[:m] / total
    found[:3] = quantiles(range_mm + offset_mm, sd_mm, weight, levels) - offset_mm
    average = np.sum(weight * range_mm)
    variance = 0.0
    for i in range(m):
        variance += weight[i] * ((range_mm[i] - average) ** 2 + sd_mm[i] * sd_mm[i])
    found[3], found[4] = average, math.sqrt(variance)
    return True, by_shape / by_shape.sum(), found
