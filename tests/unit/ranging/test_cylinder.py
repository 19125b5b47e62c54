"""Circles through spots: against scipy, and where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.statistics import inverse_of_information
from tests.support.surfaces import (
    F_PX,
    SD_PX,
    X,
    cylinder,
    seen,
)
from workbench.model.arrays import FloatArray
from workbench.ranging.cylinder import LARGEST_MM, fit_cylinder
from workbench.ranging.points import Points
from workbench.ranging.shape_kernels import circle_start

SEEDS = (1, 2, 3)


@pytest.mark.parametrize("seed", SEEDS)
def test_circles_against_scipy(seed: int) -> None:
    """The optimum along the range, by a solver that knows nothing of distances from the axis."""
    rng = np.random.default_rng(seed)
    x = np.array([-60.0, -30.0, 10.0, 30.0, 60.0])
    sigma = np.array([0.1, 0.2, 0.15, 0.2, 0.1])
    r = cylinder(250.0, 12.0)(x) + rng.normal(0.0, sigma)

    def residual(p: FloatArray) -> FloatArray:
        return np.asarray((p[1] - np.sqrt(p[2] ** 2 - (x - p[0]) ** 2) - r) / sigma)

    found = least_squares(residual, [12.0, 339.0, 89.0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    fit = fit_cylinder(Points(x, r, np.diag(sigma**2)))
    assert fit is not None
    sd = np.sqrt(np.diag(inverse_of_information(found.jac)))
    # Distance from the circle over the cosine is the misfit along the range to first order in noise / radius.
    assert np.abs((np.array([fit.axis_x_mm, fit.axis_range_mm, fit.radius_mm]) - found.x) / sd).max() < 0.02
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), sd, rtol=0.02)
    assert fit.chi2 == pytest.approx(2 * found.cost, rel=0.02)


@pytest.mark.parametrize(
    "ranges",
    [
        # The first ran off to where three parameters are one: a singular matrix, a variance below 0.
        (149.9630115393355, 150.05519845673516, 149.91103892060187, 150.00938792642353),
        (149.95065849473553, 149.98451898274138, 150.06372594965464, 150.09837833002527),
        (149.96275073216663, 149.97491801867966, 149.98454280237897, 149.9978174227135),
        (150.0, 150.0, 150.0, 150.0),
        (150.0, 151.0, 153.0, 154.0),
    ],
)
def test_points_that_are_nearly_on_a_line_are_no_circle(ranges: tuple[float, ...]) -> None:
    assert fit_cylinder(seen(X, np.array(ranges))) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_a_circle_through_noisy_flats_is_none_or_a_sound_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(1000):
        range_mm = 10.0 ** rng.uniform(2.0, 3.7)
        noise = rng.normal(0.0, 1.0, len(X)) * SD_PX / (F_PX * np.abs(X))
        circle = fit_cylinder(seen(X, 1.0 / (1.0 / range_mm + noise)))
        if circle is not None:
            assert (np.linalg.eigvalsh(circle.covariance) > 0).all()
            assert circle.radius_mm > 0


def test_the_closest_range_of_a_circle_is_its_apex_or_the_end_of_the_front() -> None:
    fit = fit_cylinder(seen(X, cylinder(300.0, 20.0)(X)))
    assert fit is not None
    assert (fit.axis_x_mm, fit.axis_range_mm, fit.radius_mm) == pytest.approx((20.0, 389.0, 89.0), abs=1e-6)
    apex, aside = fit.closest((-60.0, 60.0)), fit.closest((-60.0, -10.0))
    assert (apex.x_mm, apex.range_mm) == pytest.approx((20.0, 300.0))
    assert (aside.x_mm, aside.range_mm) == pytest.approx((-10.0, 389.0 - np.sqrt(89.0**2 - 30.0**2)))
    # At the apex the radius counts as much as the axis, against it.
    row = np.array([0.0, 1.0, -1.0])
    assert apex.sigma_mm == pytest.approx(np.sqrt(row @ fit.covariance @ row))
    # All points farther by 1 mm: so is the apex; all aside by 1 mm: it stays as near.
    assert (apex.by_range.sum(), apex.by_place.sum()) == pytest.approx((1.0, 0.0), abs=1e-6)


def test_a_place_that_errs_is_a_range_that_errs_by_the_slope() -> None:
    ranges, step = cylinder(300.0, 20.0)(X), 1e-3
    fit = fit_cylinder(seen(X, ranges))
    assert fit is not None
    for n, change in enumerate(step * np.eye(4)):
        ahead, back = (fit_cylinder(seen(X + sign * change, ranges)) for sign in (1, -1))
        assert ahead is not None
        assert back is not None
        assert fit.by_place[2, n] == pytest.approx((ahead.radius_mm - back.radius_mm) / (2 * step), abs=2e-3)


@pytest.mark.parametrize("sd_px", [0.02, 20.0])
def test_a_radius_that_is_hardly_known_is_not_told(sd_px: float) -> None:
    fit = fit_cylinder(seen(X, cylinder(300.0)(X), sd_px))
    assert (fit is None) == (sd_px > 1)
    if fit is not None:
        assert fit.radius_sigma_mm < 0.5 * fit.radius_mm


@pytest.mark.parametrize(("axis_mm", "x"), [(20.0, X), (-35.0, np.linspace(-70.0, 40.0, 7))])
def test_the_first_guess_from_points_on_a_circle_is_that_circle(axis_mm: float, x: FloatArray) -> None:
    ranges = cylinder(300.0, axis_mm)(x)
    assert circle_start(x, ranges, LARGEST_MM) == pytest.approx((axis_mm, 389.0, 89.0))
    assert np.isnan(circle_start(x, 150.0 + 0.1 * x, LARGEST_MM)).all()
    fit = fit_cylinder(seen(x, ranges))
    assert fit is not None
    assert fit.freedom == len(x) - 3


def test_a_hollow_is_no_cylinder() -> None:
    assert fit_cylinder(seen(X, 700.0 - cylinder(300.0)(X))) is None
