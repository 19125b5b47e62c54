"""Surfaces before one line of lasers, and noisy readings of them with an exact calibration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.ranging.points import Points
from workbench.ranging.polynomial import PolynomialFit, fit_polynomials
from workbench.ranging.shape import Shape, fit_shape
from workbench.ranging.shape_prior import ShapePrior, prior_components

Surface = Callable[[FloatArray], FloatArray]
X = np.array([-60.0, -30.0, 30.0, 60.0])
SD_PX = 0.064  # a spot's 0.05 px and the speckle's 0.04
F_PX = 533.0


def flat(range_mm: float) -> Surface:
    return lambda x: np.full_like(x, range_mm)


def incline(range_mm: float, angle_deg: float) -> Surface:
    """`range_mm` is the closest, at the left end."""
    return lambda x: range_mm + np.tan(np.radians(angle_deg)) * (x - X[0])


def parabola(range_mm: float) -> Surface:
    return lambda x: range_mm + 0.02 * x**2


def cubic(range_mm: float) -> Surface:
    return lambda x: range_mm + 0.0003 * (x - X[0]) ** 3


def cylinder(range_mm: float, axis_x_mm: float = 0.0, radius_mm: float = 89.0) -> Surface:
    return lambda x: range_mm + radius_mm - np.sqrt(radius_mm**2 - (x - axis_x_mm) ** 2)


def seen(x: FloatArray, range_mm: FloatArray, sd_px: float = SD_PX) -> Points:
    """What spots of this deviation tell: r^2 / (f b) of it in range."""
    return Points(x, range_mm, np.diag((sd_px * range_mm**2 / (F_PX * np.abs(x))) ** 2))


def fit_polynomial(points: Points, degree: int) -> PolynomialFit | None:
    """The maximum-likelihood polynomial of one degree."""
    return fit_polynomials(points, degree + 1).of_degree(degree)


def readings(
    surface: Surface, n: int, seed: int, x: FloatArray = X, sd_px: float = SD_PX, noise_scale: float = 1.0
) -> list[Shape]:
    """n noisy readings: Gaussian in pixels, that is in the inverse of the range.

    The noise is `noise_scale` times the stated one.
    """
    rng = np.random.default_rng(seed)
    noise = noise_scale * rng.normal(0.0, 1.0, (n, len(x))) * sd_px / (F_PX * np.abs(x))
    return [fit_shape(seen(x, 1.0 / (1.0 / surface(x) + e), sd_px)) for e in noise]


def drawn(prior: ShapePrior, closest_mm: float, rng: np.random.Generator) -> Surface:
    """A surface from the prior, `closest_mm` from the front of X; circles only where they reach past it."""
    components = prior_components(prior, (float(X[0]), float(X[-1])))
    i = rng.choice(len(components.degree), p=np.exp(components.log_mass))
    amplitudes = rng.normal(components.mean_mm[i], components.sd_mm[i])[: components.degree[i]]
    half, convex = components.half_mm, components.circle_mass[i] > 0
    if convex and amplitudes[1] > 0 and rng.random() < prior.circle:
        radius = 0.5 * half**2 / amplitudes[1]
        axis = -0.5 * half * amplitudes[0] / amplitudes[1]
        if np.abs(X - axis).max() < 0.99 * radius:
            return _before(cylinder(0.0, axis, radius), closest_mm)
    return _before(lambda x: np.polynomial.polynomial.polyval(x / half, [0.0, *amplitudes]), closest_mm)


def _before(shape: Surface, closest_mm: float) -> Surface:
    """The shape, moved so that its closest point over the front of X is at `closest_mm`."""
    lowest = float(shape(np.linspace(X[0], X[-1], 4001)).min())
    return lambda x: closest_mm - lowest + shape(x)


def share(shapes: list[Shape], is_so: Callable[[Shape], bool]) -> float:
    return float(np.mean([is_so(s) for s in shapes]))


def holds(shape: Shape, true_mm: float) -> bool:
    nearest, farthest = shape.closest_interval_mm
    return nearest <= true_mm <= farthest
