"""Posterior over the shapes in front of one line of lasers: probabilities, and the closest range.

The derivation is in docs/ranging.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.stats import norm_ppf
from workbench.ranging.cylinder import CylinderFit
from workbench.ranging.points import LEVEL, Points
from workbench.ranging.polynomial import PolynomialFit
from workbench.ranging.shape_prior import CUBIC, PriorComponents, ShapePrior, prior_components

ShapeKind = Literal["flat", "incline", "round", "cylinder"]
Candidate = tuple[ShapeKind, int]
"""Kind and degree; the degree of a circle is 2."""
TAIL_BELOW = 0.0175
"""Probability of a closest range below the interval; `1 - LEVEL - TAIL_BELOW` of one above it. A shape that
noise hides puts the closest range before that of a flat, never behind it."""
QUANTILES = np.array([TAIL_BELOW, 0.5, TAIL_BELOW + LEVEL])
NODES = (1, 16, 48, 64)
"""Number of nodes for the amplitudes of degrees 0, 1, 2, and 3 or more."""


@dataclass(frozen=True)
class ShapePosterior:
    """Posterior over shapes and sizes."""

    probabilities: Mapping[Candidate, float]
    """Of each candidate, simplest first."""
    median_mm: float
    """Median of the closest range over the front."""
    mean_mm: float
    sd_mm: float
    """Mean and standard deviation of the closest range."""
    interval_mm: tuple[float, float]
    """95 % interval of the closest range; the upper end may be infinite."""

    def deviation_mm(self, range_mm: float) -> float:
        """Root mean square deviation of the closest range from a range."""
        return math.hypot(self.sd_mm, self.mean_mm - range_mm)


def shape_posterior(
    points: Points,
    front_mm: tuple[float, float],
    fits: Sequence[PolynomialFit | None],
    circle: CylinderFit | None,
    prior: ShapePrior,
    highest: int,
) -> ShapePosterior | None:
    """Posterior over shapes, from the fits of their degrees; None where every shape lies behind the sensor.

    Args:
        points: the spots, at least one.
        front_mm: ends of the front, different.
        fits: polynomials of degree 0 to len(fits) - 1, at most len(points) - 1; None where there is none.
        circle: circle through the spots, where they determine one.
        prior: prior over shapes.
        highest: largest degree of a shape, at least 1; the spots need not determine it.
    """
    from workbench.ranging.mixture_kernels import posterior  # loads the compiler

    components = prior_components(prior, front_mm, highest)
    evidence, closest, share, own_sd = posterior(
        (points.x_mm - components.middle_mm) / components.half_mm,
        *_likelihoods(points, components, fits),
        components.degree,
        components.log_mass if circle is None else components.log_mass + components.log_parabola,
        components.mean_mm,
        components.sd_mm,
        *_nodes(components.mean_mm.shape[1]),
        _floor_mm(points),
    )
    if circle is not None:
        near = circle.closest(front_mm)
        possible = near.range_mm > _floor_mm(points)
        evidence = np.append(evidence, _circle_evidence(points, components, circle) if possible else -np.inf)
        closest = np.vstack([closest, np.full_like(closest[0], near.range_mm)])
        share = np.vstack([share, np.eye(1, share.shape[1])])
        own_sd = np.append(own_sd, near.sigma_mm)
    if not (share * np.exp(evidence - evidence.max())[:, None] > 0.0).any():
        return None
    probability = np.exp(evidence - evidence.max())
    probability /= probability.sum()
    weight = share * probability[:, None]
    used = weight > 0.0
    sd = np.broadcast_to(own_sd[:, None], share.shape)
    return _summary(
        _probabilities(components, probability), points, closest[used], sd[used], weight[used] / weight.sum()
    )


def _floor_mm(points: Points) -> float:
    """Smallest possible range: neither behind the reference plane nor behind the pinhole."""
    return max(0.0, -points.offset_mm)


def _summary(
    probabilities: Mapping[Candidate, float],
    points: Points,
    closest_mm: FloatArray,
    sd_mm: FloatArray,
    weight: FloatArray,
) -> ShapePosterior:
    """Posterior from the nodes (m,) of the closest range, whose weights sum to 1."""
    from workbench.ranging.mixture_kernels import quantiles  # loads the compiler

    depths = quantiles(closest_mm + points.offset_mm, sd_mm, weight, QUANTILES)
    low, median, high = (depths - points.offset_mm).tolist()
    mean = float(weight @ closest_mm)
    variance = float(weight @ ((closest_mm - mean) ** 2 + sd_mm**2))
    return ShapePosterior(probabilities, median, mean, math.sqrt(variance), (low, high))


def _likelihoods(
    points: Points, components: PriorComponents, fits: Sequence[PolynomialFit | None]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Arguments of `posterior`; degrees that the spots do not determine have the last fit's."""
    size, n = components.mean_mm.shape[1] + 1, len(points)
    estimate, depth = np.zeros((size, size)), np.ones((size, n))
    weight, chi2 = np.zeros((size, n, n)), np.full(size, np.nan)
    for degree in range(size):
        fit = fits[min(degree, len(fits) - 1)]
        if fit is None:
            continue
        shift = _shift(components.middle_mm, components.half_mm, fit.degree)
        estimate[degree, : fit.degree + 1] = shift @ fit.per_mm()
        depth[degree], weight[degree], chi2[degree] = fit.depth_mm, fit.weight, fit.chi2
    return estimate, depth, weight, chi2


def _circle_evidence(points: Points, components: PriorComponents, circle: CylinderFit) -> float:
    """Log evidence of circles, by Laplace's method about the fit, in the units of `posterior`."""
    density = components.circle_log_density(circle.axis_x_mm, circle.radius_mm)
    _, log_determinant = np.linalg.slogdet(circle.covariance)
    volume = math.log(2.0 * math.pi) + 0.5 * float(log_determinant)
    # The polynomials' density is that of inverse depths: d(1 / z) = dz / z^2.
    by_inverse_depth = 2.0 * float(np.log(points.range_mm + points.offset_mm).sum())
    return density + volume + circle.log_density + by_inverse_depth - 0.5 * circle.chi2


def _probabilities(components: PriorComponents, probability: FloatArray) -> dict[Candidate, float]:
    """Probability of each candidate, simplest first.

    Args:
        components: C components of the prior.
        probability: (C,) of them, or (C + 1,) where the last is that of circles.
    """
    by_degree = np.bincount(components.degree, probability[: len(components.degree)]).tolist()
    kinds: tuple[ShapeKind, ...] = ("flat", "incline")
    found: dict[Candidate, float] = {}
    for degree, of_degree in enumerate(by_degree):
        found[kinds[degree] if degree < len(kinds) else "round", degree] = of_degree
        if degree == len(kinds):
            found["cylinder", degree] = float(probability[len(components.degree) :].sum())
    return found


@lru_cache(maxsize=64)
def _shift(middle_mm: float, half_mm: float, degree: int) -> FloatArray:
    """(degree + 1, degree + 1) from coefficients of x^k to those of t^k, x = middle + half t."""
    rows = [
        [math.comb(k, j) * middle_mm ** (k - j) * half_mm**j if k >= j else 0.0 for k in range(degree + 1)]
        for j in range(degree + 1)
    ]
    return np.array(rows)


@lru_cache(maxsize=8)
def _nodes(highest: int) -> tuple[FloatArray, IndexArray]:
    """(highest + 1, M, highest) standard normal nodes of equal weight, and how many each degree has.

    The first coordinate of degree d has equal steps of probability. The others are an additive recurrence
    with the powers of the inverse of the root of x^d = x + 1 (Roberts 2018). Mean 0 and covariance 1 are
    exact.
    """
    counts = np.array([NODES[min(degree, CUBIC)] for degree in range(highest + 1)], np.intp)
    nodes = np.zeros((highest + 1, counts.max(), highest))
    for degree in range(1, highest + 1):
        root = 2.0
        for _ in range(60):
            root = (1.0 + root) ** (1.0 / degree)
        index = np.arange(counts[degree])
        others = np.outer(index + 1.0, root ** -np.arange(1.0, degree)) % 1.0
        normal = norm_ppf(np.column_stack([(index + 0.5) / counts[degree], others]))
        normal -= normal.mean(axis=0)
        covariance = normal.T @ normal / len(normal)
        nodes[degree, : counts[degree], :degree] = np.linalg.solve(np.linalg.cholesky(covariance), normal.T).T
    return nodes, counts
