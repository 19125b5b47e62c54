"""Polynomials through spots against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.statistics import inverse_of_information
from workbench.model.arrays import FloatArray
from workbench.ranging.points import Points
from workbench.ranging.polynomial import fit_polynomial

SEEDS = (1, 2, 3)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("seed", SEEDS)
def test_polynomials_against_scipy(degree: int, seed: int) -> None:
    """Correlated ranges: the same optimum and covariance as least squares on whitened inverse depths."""
    rng = np.random.default_rng(seed)
    root = rng.normal(0.0, 1.0, (5, 5)) + 3 * np.eye(5)
    x = np.array([-70.0, -35.0, 5.0, 40.0, 60.0])
    points = Points(x, 800.0 + root @ rng.normal(0.0, 1.0, 5), root @ root.T, offset_mm=12.0)
    depth = points.range_mm + 12.0
    whiten = np.linalg.inv(np.linalg.cholesky(points.covariance_mm2 / np.outer(depth**2, depth**2)))

    def residual(c: FloatArray) -> FloatArray:
        model = np.polynomial.polynomial.polyval(x, c) + 12.0
        return np.asarray(whiten @ (1.0 / depth - 1.0 / model))

    scale = 70.0 ** np.arange(degree + 1)
    start = np.zeros(degree + 1)
    start[0] = 800.0
    found = least_squares(residual, start, x_scale=1.0 / scale, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    fit = fit_polynomial(points, degree)
    assert fit is not None
    np.testing.assert_allclose(fit.per_mm(), found.x, rtol=1e-6)
    assert fit.chi2 == pytest.approx(2 * found.cost, rel=1e-6)
    expected = inverse_of_information(found.jac) * np.outer(scale, scale)
    np.testing.assert_allclose(fit.covariance, expected, rtol=1e-4)
