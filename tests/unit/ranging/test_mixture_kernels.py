"""The compiled posterior: minima of polynomials, quantiles of mixtures, evidence against integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import multivariate_normal, norm

from tests.support.surfaces import X, flat, incline, seen
from workbench.model.arrays import FloatArray
from workbench.ranging.mixture_kernels import (
    _back,
    _cholesky,
    _forward,
    _merged,
    lowest,
    posterior,
    quantiles,
)
from workbench.ranging.points import interval_mm
from workbench.ranging.polynomial import fit_polynomials


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_minimum_of_a_polynomial_is_that_of_a_fine_grid(degree: int, seed: int) -> None:
    t = np.linspace(-1.0, 1.0, 20_001)
    rng = np.random.default_rng(seed)
    for _ in range(200):
        amplitudes = np.concatenate([[7.0], rng.normal(size=degree) * 10.0 ** rng.uniform(-3, 3, degree)])
        values = np.polynomial.polynomial.polyval(t, [0.0, *amplitudes[1:]])
        size = np.abs(amplitudes[1:]).max()
        value, at = lowest(amplitudes, degree)
        assert value == pytest.approx(values.min(), abs=(1e-7 if degree < 4 else 1e-3) * size)
        assert np.polynomial.polynomial.polyval(at, [0.0, *amplitudes[1:]]) == pytest.approx(value)


@pytest.mark.parametrize("at", [-0.713, 0.004, 0.642])
def test_between_the_steps_of_its_grid_a_search_follows_the_parabola(at: float) -> None:
    """A quadratic that is searched as a polynomial of degree 4: its vertex is found to rounding."""
    amplitudes = np.array([0.0, -2.0 * at, 1.0, 0.0, 0.0])
    assert lowest(amplitudes, 4) == pytest.approx((-(at**2), at), abs=1e-9)


@pytest.mark.parametrize("size", [1, 2, 4])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_leading_block_of_a_system_is_solved_and_the_rest_stays(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn, vector = rng.normal(size=(5, 8)), rng.normal(size=5)
    matrix, root = drawn @ drawn.T, np.full((5, 5), 7.0)
    assert _cholesky(matrix, size, root)
    expected = vector.copy()
    expected[:size] = np.linalg.solve(matrix[:size, :size], vector[:size])
    _forward(root, size, vector)
    _back(root, size, vector)
    np.testing.assert_allclose(vector, expected)
    matrix[size - 1, size - 1] = -1.0
    assert not _cholesky(matrix, size, root)


@pytest.mark.parametrize("sd_mm", [0.5, 10.0])
def test_nodes_closer_than_their_deviation_are_merged_and_keep_their_moments(sd_mm: float) -> None:
    depth, weight = 1000.0 + sd_mm * np.array([5.0, 0.1, 0.0, 1.0]), np.array([0.1, 0.2, 0.3, 0.4])
    sd = sd_mm * np.array([1.0, 1.5, 1.0, 2.0])
    found, found_sd, total = _merged(depth, sd, weight)
    assert total == pytest.approx([0.5, 0.4, 0.1])
    mean = np.average(depth[[1, 2]], weights=weight[[1, 2]])
    square = np.average(sd[[1, 2]] ** 2 + (depth[[1, 2]] - mean) ** 2, weights=weight[[1, 2]])
    assert found == pytest.approx([mean, depth[3], depth[0]], rel=1e-12)
    assert found_sd == pytest.approx([np.sqrt(square), sd[3], sd[0]], rel=1e-6)


@pytest.mark.parametrize("sd", [1.0, 100.0, 300.0])
def test_quantiles_of_one_node_are_those_of_a_gaussian_inverse_depth(sd: float) -> None:
    found = quantiles(np.array([1000.0]), np.array([sd]), np.ones(1), np.array([0.025, 0.5, 0.975]))
    low, high = interval_mm(1000.0, sd)
    np.testing.assert_allclose(found, [low, 1000.0, high], atol=2e-3 * sd)


def test_a_quantile_beyond_infinity_is_infinite() -> None:
    found = quantiles(np.array([1000.0]), np.array([600.0]), np.ones(1), np.array([0.5, 0.975]))
    assert found[0] == pytest.approx(1000.0, abs=1.0)
    assert np.isinf(found[1])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_quantiles_of_a_mixture_are_those_of_its_distribution(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth, sd = rng.normal(2000.0, 60.0, 400), np.full(400, 12.0)
    weight = rng.uniform(size=400)
    weight /= weight.sum()

    def below(at: float) -> float:
        return float(weight @ norm.cdf((1.0 / depth - 1.0 / at) * depth**2 / sd))

    levels = np.array([0.0175, 0.5, 0.9675])
    expected = [brentq(lambda at, p=p: below(at) - p, 1000.0, 4000.0) for p in levels]
    np.testing.assert_allclose(quantiles(depth, sd, weight, levels), expected, atol=1.0)


def test_the_evidence_of_inclines_is_that_of_their_marginal_likelihood() -> None:
    """Ratio to a flat: Gaussian ranges whose covariance has the prior of the slope in it."""
    ranges = incline(3000.0, 8.0)(X)
    points = seen(X, ranges)
    fits = fit_polynomials(points, 2)
    sd_mm = 20.0
    evidence, _, _, _ = posterior(
        X / 60.0,
        fits.coefficients,
        fits.depth_mm,
        fits.weight,
        fits.chi2,
        np.array([0, 1]),
        np.zeros(2),
        np.zeros((2, 1)),
        np.array([[1.0], [sd_mm]]),
        np.zeros((2, 1, 1)),
        np.array([1, 1]),
        0.0,
    )

    def marginal(slope_sd_mm: float) -> float:
        """Log density of the ranges, their mean with a very wide prior."""
        wide, t = 1e4, X / 60.0
        covariance = points.covariance_mm2 + wide**2 + slope_sd_mm**2 * np.outer(t, t)
        return float(multivariate_normal(np.full(4, ranges.mean()), covariance).logpdf(ranges))

    assert evidence[1] - evidence[0] == pytest.approx(marginal(sd_mm) - marginal(0.0), abs=0.02)


def closest_nodes(surface: FloatArray, floor: float) -> tuple[FloatArray, FloatArray]:
    """Evidence and weights of the nodes of a flat and of inclines."""
    points = seen(X, surface)
    fits = fit_polynomials(points, 2)
    nodes = np.zeros((2, 3, 1))
    nodes[1, :, 0] = (-1.0, 0.0, 1.0)
    evidence, _, share, _ = posterior(
        X / 60.0,
        fits.coefficients,
        fits.depth_mm,
        fits.weight,
        fits.chi2,
        np.array([0, 1]),
        np.zeros(2),
        np.zeros((2, 1)),
        np.array([[1.0], [30.0]]),
        nodes,
        np.array([1, 3]),
        floor,
    )
    return evidence, share


def test_shapes_behind_the_floor_have_no_weight() -> None:
    evidence, share = closest_nodes(flat(3000.0)(X), 0.0)
    assert share.sum(axis=1) == pytest.approx([1.0, 1.0])
    behind, none = closest_nodes(flat(3000.0)(X), 2995.0)
    assert none[1].sum() < 1.0
    assert behind[1] == pytest.approx(evidence[1] + np.log(none[1].sum()))
    nothing, _ = closest_nodes(flat(3000.0)(X), 5000.0)
    assert np.isneginf(nothing).all()
