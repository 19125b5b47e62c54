"""Posterior over the shapes in front of one line of lasers: probabilities, and the closest range.

The derivation is in docs/ranging.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.stats import norm_ppf
from workbench.ranging.cylinder import CylinderFit
from workbench.ranging.points import LEVEL, Closest, Points
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
    """Posterior over shapes, from the fits of their degrees.

    None where all shapes that agree with the spots lie behind the sensor.

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
    nodes = _Nodes(
        *posterior(
            (points.x_mm - components.middle_mm) / components.half_mm,
            *_likelihoods(points, components, fits),
            components.degree,
            components.log_mass if circle is None else components.log_mass + components.log_parabola,
            components.mean_mm,
            components.sd_mm,
            *_nodes(components.mean_mm.shape[1]),
            _floor_mm(points),
        )
    )
    if circle is not None:
        near, evidence = circle.closest(front_mm), _circle_evidence(points, components, circle)
        nodes = nodes.and_one(near, evidence if near.range_mm > _floor_mm(points) else -np.inf)
    mass = nodes.mass()
    if not (nodes.share.any(axis=1) & (mass > 0.0)).any():
        return None
    return _summary(_probabilities(components, mass / mass.sum()), points, nodes.mixture(mass))


class _Nodes(NamedTuple):
    """Nodes of the closest range of C components, M each; see `mixture_kernels.posterior`."""

    log_evidence: FloatArray
    range_mm: FloatArray
    share: FloatArray
    sd_mm: FloatArray

    def and_one(self, closest: Closest, log_evidence: float) -> _Nodes:
        """The nodes, and a component with a single one."""
        _, size = self.share.shape
        return _Nodes(
            np.append(self.log_evidence, log_evidence),
            np.vstack([self.range_mm, np.full(size, closest.range_mm)]),
            np.vstack([self.share, np.eye(1, size)]),
            np.append(self.sd_mm, closest.sigma_mm),
        )

    def mass(self) -> FloatArray:
        """(C,) evidence of the components, relative to the largest."""
        best = float(self.log_evidence.max())
        return np.exp(self.log_evidence - best) if math.isfinite(best) else np.zeros(len(self.log_evidence))

    def mixture(self, mass: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(m,) ranges, deviations and weights of the nodes, by the mass (C,) of the components."""
        weight = self.share * mass[:, None]
        used = weight > 0.0
        sd = np.broadcast_to(self.sd_mm[:, None], used.shape)[used]
        return self.range_mm[used], sd, weight[used] / weight.sum()


def _floor_mm(points: Points) -> float:
    """Smallest possible range: neither behind the reference plane nor behind the pinhole."""
    return max(0.0, -points.offset_mm)


def _summary(
    probabilities: Mapping[Candidate, float],
    points: Points,
    mixture: tuple[FloatArray, FloatArray, FloatArray],
) -> ShapePosterior:
    """Posterior from nodes (m,) of the closest range: range, deviation, and weight, 1 in total."""
    from workbench.ranging.mixture_kernels import quantiles  # loads the compiler

    range_mm, sd_mm, weight = mixture
    depths = quantiles(range_mm + points.offset_mm, sd_mm, weight, QUANTILES)
    low, median, high = (depths - points.offset_mm).tolist()
    mean = float(weight @ range_mm)
    variance = float(weight @ ((range_mm - mean) ** 2 + sd_mm**2))
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
