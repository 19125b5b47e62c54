"""The posterior over shapes: closest range and probabilities against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.surfaces import F_PX, SD_PX, Surface, X, cylinder, flat, incline, parabola, seen
from workbench.model.arrays import FloatArray
from workbench.ranging.cylinder import fit_cylinder
from workbench.ranging.mixture import TAIL_BELOW, ShapePosterior, shape_posterior
from workbench.ranging.points import LEVEL, Points
from workbench.ranging.polynomial import fit_polynomials
from workbench.ranging.shape_prior import PriorComponents, ShapePrior, prior_components

FRONT_MM = (-60.0, 60.0)
PARABOLAS = ShapePrior(circle=0.0)
"""Circles are left out where brute force draws polynomials."""


def posterior_of(points: Points, prior: ShapePrior = PARABOLAS, highest: int = 3) -> ShapePosterior:
    fits = fit_polynomials(points, min(len(points), 4))
    circle = fit_cylinder(points) if prior.circle and len(points) > 2 else None
    found = shape_posterior(points, FRONT_MM, fits, circle, prior, highest)
    assert found is not None
    return found


def brute_force(points: Points, n: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Closest range, weight and degree of n shapes drawn from the prior, weighted by the likelihood."""
    rng = np.random.default_rng(seed)
    components: PriorComponents = prior_components(PARABOLAS, FRONT_MM)
    drawn = rng.choice(len(components.degree), n, p=np.exp(components.log_mass))
    amplitudes = rng.normal(components.mean_mm[drawn], components.sd_mm[drawn])
    amplitudes *= np.arange(3) < components.degree[drawn, None]
    t = np.linspace(-1.0, 1.0, 41)
    surface = amplitudes @ np.array([X / 60.0, (X / 60.0) ** 2, (X / 60.0) ** 3])
    lowest = (amplitudes @ np.array([t, t**2, t**3])).min(axis=1)
    middle = points.range_mm.mean() + rng.uniform(-400.0, 400.0, n)
    depth = middle[:, None] + surface
    z = (1.0 / depth - 1.0 / points.range_mm) * F_PX * np.abs(X) / SD_PX
    weight = np.exp(-0.5 * (z**2).sum(axis=1)) * (depth > 0).all(axis=1)
    return middle + lowest, weight / weight.sum(), components.degree[drawn].astype(np.float64)


@pytest.mark.long_cases
@pytest.mark.parametrize("surface", [flat(4500.0), incline(4500.0, 20.0), parabola(4500.0)])
def test_the_posterior_is_that_of_shapes_drawn_from_the_prior(surface: Surface) -> None:
    """Far away, where the prior matters and brute force has enough shapes that agree with the spots."""
    points = seen(X, surface(X))
    found = posterior_of(points)
    closest, weight, degree = brute_force(points, 1_500_000, 7)
    order = np.argsort(closest)
    below = np.cumsum(weight[order])
    low, median, high = (
        closest[order][np.searchsorted(below, p)] for p in (TAIL_BELOW, 0.5, TAIL_BELOW + LEVEL)
    )
    length = high - low
    np.testing.assert_allclose([*found.interval_mm, found.median_mm], [low, high, median], atol=0.04 * length)
    for (_, of), p in found.probabilities.items():
        if of in (0, 1, 3):
            assert p == pytest.approx(weight[degree == of].sum(), abs=0.03)


def test_a_flat_that_is_certain_has_the_interval_of_the_flat_fit() -> None:
    points = seen(X, flat(150.0)(X))
    found, fit = posterior_of(points), fit_polynomials(points, 1).of_degree(0)
    assert fit is not None
    assert found.median_mm == pytest.approx(150.0, abs=1e-3)
    assert found.deviation_mm(150.0) == pytest.approx(fit.closest(FRONT_MM).sigma_mm, rel=0.05)
    assert found.probabilities["flat", 0] > 0.99


def test_shapes_that_the_spots_do_not_determine_have_the_prior_s_sizes() -> None:
    points = seen(X[[0, 3]], np.array([800.0, 800.0]))
    all_shapes, planes = posterior_of(points), posterior_of(points, highest=1)
    assert all_shapes.interval_mm[0] < planes.interval_mm[0] - 20.0
    assert all_shapes.interval_mm[1] == pytest.approx(planes.interval_mm[1], abs=1.0)


def test_a_circle_and_a_parabola_that_agree_with_the_spots_share_the_probability() -> None:
    found = posterior_of(seen(X, cylinder(300.0)(X)), ShapePrior())
    shares = found.probabilities["round", 2], found.probabilities["cylinder", 2]
    assert sum(shares) == pytest.approx(1.0, abs=0.01)
    assert min(shares) > 0.25


def test_shapes_behind_the_sensor_have_no_posterior() -> None:
    wall = seen(X, incline(100.0, 60.0)(X))
    fits = fit_polynomials(wall, 4)
    assert shape_posterior(wall, (-1000.0, 60.0), fits, None, PARABOLAS, 3) is None
