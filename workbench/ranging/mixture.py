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
from workbench.ranging.polynomial import PolynomialFits
from workbench.ranging.shape_prior import CUBIC, ShapePrior, prior_components

ShapeKind = Literal["flat", "incline", "round", "cylinder"]
Candidate = tuple[ShapeKind, int]
"""Kind and degree; the degree of a circle is 2."""
TAIL_BELOW = 0.0175
"""Probability of a closest range below the interval; `1 - LEVEL - TAIL_BELOW` of one above it. A shape that
noise hides puts the closest range before that of a flat, never behind it."""
QUANTILES = np.array([TAIL_BELOW, 0.5, TAIL_BELOW + LEVEL])
CircleArguments = tuple[tuple[float, float, float, float, float, float], FloatArray]
NO_CIRCLE: CircleArguments = ((0.0, 0.0, math.nan, 0.0, 0.0, 0.0), np.eye(3))
"""Arguments of `posterior_kernels.shape_mixture` where there is no circle."""
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
    fits: PolynomialFits,
    circle: CylinderFit | None,
    prior: ShapePrior,
    highest: int,
) -> ShapePosterior | None:
    """Posterior over shapes, from the fits of their degrees.

    None where all shapes that agree with the spots lie behind the sensor.

    Args:
        points: the spots, at least one.
        front_mm: ends of the front, different.
        fits: polynomials of at most len(points) degrees.
        circle: circle through the spots, where they determine one.
        prior: prior over shapes.
        highest: largest degree of a shape, at least 1; the spots need not determine it.
    """
    from workbench.ranging.posterior_kernels import shape_mixture  # loads the compiler

    of_prior, (nodes, counts) = prior_components(prior, front_mm, highest), _nodes(highest)
    of_circle, circle_covariance = NO_CIRCLE if circle is None else _of_circle(circle, front_mm)
    exists, by_shape, found = shape_mixture(
        points.x_mm,
        points.range_mm,
        points.offset_mm,
        fits.coefficients,
        fits.depth_mm,
        fits.weight,
        fits.chi2,
        fits.scale_mm,
        of_circle,
        circle_covariance,
        of_prior.middle_mm,
        of_prior.half_mm,
        of_prior.degree,
        of_prior.log_mass,
        of_prior.mean_mm,
        of_prior.sd_mm,
        of_prior.log_parabola,
        of_prior.circle_mass,
        nodes,
        counts,
        _floor_mm(points),
        QUANTILES,
    )
    if not exists:
        return None
    low, median, high, mean, sd = found.tolist()
    return ShapePosterior(_probabilities(by_shape.tolist()), median, mean, sd, (low, high))


def _of_circle(circle: CylinderFit, front_mm: tuple[float, float]) -> CircleArguments:
    """Arguments `circle` and `circle_covariance` of `posterior_kernels.shape_mixture`."""
    nearest = circle.closest(front_mm)
    of_fit = circle.axis_x_mm, circle.radius_mm, circle.chi2, circle.log_density
    return (*of_fit, nearest.range_mm, nearest.sigma_mm), circle.covariance


def _floor_mm(points: Points) -> float:
    """Smallest possible range: neither behind the reference plane nor behind the pinhole."""
    return max(0.0, -points.offset_mm)


def _probabilities(by_shape: Sequence[float]) -> dict[Candidate, float]:
    """Probability of each candidate, simplest first, from those of the degrees and, last, of circles."""
    kinds: tuple[ShapeKind, ...] = ("flat", "incline")
    found: dict[Candidate, float] = {}
    for degree, probability in enumerate(by_shape[:-1]):
        found[kinds[degree] if degree < len(kinds) else "round", degree] = probability
        if degree == len(kinds):
            found["cylinder", degree] = by_shape[-1]
    return found


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
