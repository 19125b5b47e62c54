"""The compiled posterior over shapes: change of the unit of a polynomial, prior density of circles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import dblquad

from workbench.ranging.posterior_kernels import _fill_estimate, circle_log_density
from workbench.ranging.shape_prior import ShapePrior, prior_components

PRIOR = ShapePrior()


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coefficients_in_half_fronts_are_those_of_the_composed_polynomial(degree: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    coefficients, start, step = rng.normal(0.0, 1.0, degree + 1), rng.normal(), rng.uniform(0.5, 2.0)
    out = np.full(degree + 1, np.nan)
    _fill_estimate(coefficients, start, step, out)
    composed = np.asarray(Polynomial(coefficients)(Polynomial([start, step])).coef, float)
    np.testing.assert_allclose(out, composed, atol=1e-12)


@pytest.mark.parametrize("middle_mm", [0.0, 25.0])
def test_the_density_of_circles_has_their_probability_in_total(middle_mm: float) -> None:
    """Over radii and positions of the axis; curvatures below 0 (2 in 1000) have no circle."""
    components = prior_components(PRIOR, (middle_mm - 60.0, middle_mm + 60.0))
    front = components.middle_mm, components.half_mm
    amplitudes = components.mean_mm, components.sd_mm, components.circle_mass

    def density(axis_mm: float, log_radius: float) -> float:
        radius = np.exp(log_radius)
        return float(np.exp(circle_log_density(axis_mm, radius, *front, *amplitudes)) * radius)

    total, _ = dblquad(
        density, np.log(2.0), np.log(20_000.0), middle_mm - 300.0, middle_mm + 300.0, epsabs=1e-4
    )
    assert total == pytest.approx(components.circle_mass.sum(), rel=0.01)
    assert total == pytest.approx(PRIOR.circle * (1.0 - PRIOR.concave) * PRIOR.round, rel=0.01)


def test_a_circle_that_the_prior_excludes_has_no_density() -> None:
    components = prior_components(ShapePrior(circle=0.0), (-60.0, 60.0))
    amplitudes = components.mean_mm, components.sd_mm, components.circle_mass
    assert circle_log_density(0.0, 90.0, 0.0, 60.0, *amplitudes) == -np.inf
