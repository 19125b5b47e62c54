"""Prior over the shapes in front of one line of lasers, and their sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.errors import BadInputError
from workbench.model.problems import short

CUBIC = 3
"""Degree of an irregular surface; the front of four lasers determines no higher one."""
SHAPES = ("flat", "incline", "round", "irregular")
PROBABILITIES = (*SHAPES, "concave", "circle", "steep")
SIZES = ("relative_curvature_sd", "apex_sd", "steep_factor")
SEVERAL_SIZES = ("slope_sds", "curvatures_per_mm", "irregular_sds")
SMALLEST, LARGEST = 1e-12, 1e6
"""Bounds of the sizes: their squares and quotients neither vanish nor overflow."""


@dataclass(frozen=True)
class ShapePrior:
    """Probabilities of the shapes, and distributions of their sizes; mm, over the position x along the front.

    The range at the middle of the front has a uniform prior, common to all shapes. Each size is a mixture of
    Gaussians, so that the posterior is one too. The defaults describe a robot's surroundings: walls and
    boxes, inclines up to some 70 degrees, convex objects with radii of 15 to 200 mm (docs/ranging.md).
    """

    flat: float = 0.44
    incline: float = 0.12
    round: float = 0.36
    """Parabola or circle."""
    irregular: float = 0.08
    """Cubic, and higher degrees where more than four lasers reject it."""
    slope_sds: tuple[float, ...] = (0.085, 1.5)
    """Standard deviations of an incline's slope (tangent of its angle); equally likely."""
    curvatures_per_mm: tuple[float, ...] = (0.0055, 0.023)
    """Typical curvatures c of a round surface, 1 / (2 radius): radii of 91 and 22 mm; equally likely."""
    relative_curvature_sd: float = 0.33
    """Standard deviation of a curvature, relative to the typical one."""
    concave: float = 0.05
    """Probability that a round surface is concave, given that it is round."""
    circle: float = 0.65
    """Probability that a convex round surface is a circle, where the spots determine one; else it is a
    parabola, from which that circle does not differ."""
    apex_sd: float = 0.25
    """Standard deviation of the apex's position about the middle of the front, in half fronts."""
    irregular_sds: tuple[float, float, float] = (2.0, 0.03, 8e-4)
    """Standard deviations of slope, curvature (1/mm) and third coefficient (1/mm^2) of an irregular one."""
    steep: float = 0.1
    """Probability that these are `steep_factor` larger, given that the surface is irregular: steps. Half of
    them are parabolas, half cubic."""
    steep_factor: float = 6.0

    def __post_init__(self) -> None:
        """Check types and bounds of the numbers, and the sum of the probabilities of the shapes.

        Raises:
            BadInputError: a number is none or outside its bounds, or the probabilities do not add up to 1.
        """
        for name in PROBABILITIES:
            _check_number(name, getattr(self, name), 0.0, 1.0)
        for name in SIZES:
            _check_number(name, getattr(self, name), SMALLEST, LARGEST)
        for name in SEVERAL_SIZES:
            sizes = getattr(self, name)
            if not isinstance(sizes, tuple) or not sizes:
                raise BadInputError(f"ShapePrior: {name}: expected a tuple of numbers, got {short(sizes)}")
            for size in sizes:
                _check_number(name, size, SMALLEST, LARGEST)
        if (count := len(self.irregular_sds)) != CUBIC:
            raise BadInputError(f"ShapePrior: irregular_sds: expected {CUBIC} numbers, got {count}")
        shapes = {name: getattr(self, name) for name in SHAPES}
        if not math.isclose(sum(shapes.values()), 1.0, abs_tol=1e-9):
            got = ", ".join(f"{name}={value:g}" for name, value in shapes.items())
            raise BadInputError(
                f"ShapePrior: expected probabilities from 0 that add up to 1, got {got} (sum"
                f" {sum(shapes.values()):g}); state all four"
            )


def _check_number(name: str, value: object, low: float, high: float) -> None:
    """Raise if a value is no number from `low` to `high`."""
    is_bool = isinstance(value, bool)
    if isinstance(value, int | float | np.integer | np.floating) and not is_bool and low <= value <= high:
        return
    raise BadInputError(f"ShapePrior: {name}: expected a number from {low:g} to {high:g}, got {short(value)}")


class PriorComponents(NamedTuple):
    """C Gaussian components in amplitudes: range = a + sum of amplitude[k] t^k, k from 1, mm.

    t is the position from the middle of the front in half fronts; degrees up to K.
    """

    middle_mm: float
    half_mm: float
    degree: IndexArray
    """(C,)"""
    log_mass: FloatArray
    """(C,)"""
    mean_mm: FloatArray
    """(C, K) of the amplitudes; 0 beyond the degree."""
    sd_mm: FloatArray
    """(C, K); 1 beyond the degree."""
    log_parabola: FloatArray
    """(C,) log probability of the component where the spots determine a circle, given that of `log_mass`."""
    circle_mass: FloatArray
    """(C,) probability of circles with the component's curvature and apex."""


@lru_cache(maxsize=64)
def prior_components(
    prior: ShapePrior, front_mm: tuple[float, float], highest: int = CUBIC
) -> PriorComponents:
    """Components of the prior for a front.

    Args:
        prior: the prior.
        front_mm: ends of the front, different.
        highest: largest degree, at least 1; components of higher degrees are left out.
    """
    half = 0.5 * (front_mm[1] - front_mm[0])
    rows = [(0, prior.flat, (), (), 0.0), *_inclines(prior, half), *_rounds(prior, half)]
    rows += _irregular(prior, half, 1.0, 1.0 - prior.steep, range(CUBIC, highest + 1))
    rows += _irregular(prior, half, prior.steep_factor, 0.5 * prior.steep, range(CUBIC - 1, highest + 1))
    rows = [row for row in rows if row[0] <= highest]
    mean, sd = np.zeros((len(rows), highest)), np.ones((len(rows), highest))
    mass, convex = np.array([row[1] for row in rows]), np.array([row[4] for row in rows])
    for i, (degree, _, means, sds, _) in enumerate(rows):
        mean[i, :degree], sd[i, :degree] = means, sds
    with np.errstate(divide="ignore"):  # a probability of 0
        log_mass, log_parabola = np.log(mass), np.log(1.0 - prior.circle * convex)
    degrees = np.array([row[0] for row in rows], np.intp)
    middle = 0.5 * (front_mm[0] + front_mm[1])
    return PriorComponents(
        middle, half, degrees, log_mass, mean, sd, log_parabola, prior.circle * convex * mass
    )


_Row = tuple[int, float, tuple[float, ...], tuple[float, ...], float]
"""Degree, mass, means and standard deviations of the amplitudes, and whether it is a convex parabola."""


def _inclines(prior: ShapePrior, half: float) -> list[_Row]:
    mass = prior.incline / len(prior.slope_sds)
    return [(1, mass, (0.0,), (sd * half,), 0.0) for sd in prior.slope_sds]


def _rounds(prior: ShapePrior, half: float) -> list[_Row]:
    """A slope in the middle of the front places the apex: -2 times curvature times its position."""
    rows: list[_Row] = []
    mass = prior.round / len(prior.curvatures_per_mm)
    for typical in prior.curvatures_per_mm:
        size = typical * half**2
        sds = 2.0 * prior.apex_sd * size, prior.relative_curvature_sd * size
        rows.append((2, (1.0 - prior.concave) * mass, (0.0, size), sds, 1.0))
        rows.append((2, prior.concave * mass, (0.0, -size), sds, 0.0))
    return rows


def _irregular(prior: ShapePrior, half: float, factor: float, share: float, degrees: range) -> list[_Row]:
    """Amplitudes beyond the cubic one have its deviation."""
    sds = [factor * sd * half**k for k, sd in enumerate(prior.irregular_sds, 1)]
    rows: list[_Row] = []
    for degree in degrees:
        sds_of = (*sds[:degree], *[sds[-1]] * (degree - CUBIC))
        rows.append((degree, share * prior.irregular, (0.0,) * degree, sds_of, 0.0))
    return rows
