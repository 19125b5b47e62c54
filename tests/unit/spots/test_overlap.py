"""Deviations of two spots that are fitted together: the second order, and the inverse behind them."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.fit import Windows
from workbench.spots.gaussian import FLUX, LN_SU, U, derivatives
from workbench.spots.joint import _jacobian, fit_joint
from workbench.spots.noise import Noise
from workbench.spots.sums import invert

WIDTH, HALF, APART, TOLD = 2.5, 12, 3.0, 400.0
SHAPE = (2 * HALF + 1, 2 * HALF + 1)
PAIRS = 500


def two_spots(rng: np.random.Generator) -> np.ndarray:
    """(2, 6) true parameters, three widths apart, in noise of 1 DN."""
    true = np.zeros((2, 6))
    true[:, FLUX], true[:, LN_SU:] = np.sqrt(TOLD * 4.0 * np.pi) * WIDTH, np.log(WIDTH)
    true[:, U] = HALF + rng.uniform(-0.5, 0.5) + np.array([-0.5, 0.5]) * APART * WIDTH
    true[:, U + 1] = HALF + rng.uniform(-0.5, 0.5)
    return true


def test_the_deviations_of_spots_fitted_together_are_right_to_second_order() -> None:
    rng = np.random.default_rng(1)
    white = Noise(np.ones(1), np.full(1, 1e-9))
    terms = []
    for _ in range(PAIRS):
        true = two_spots(rng)
        rows = derivatives(true, SHAPE).reshape(2, 6, -1)
        jacobian = _jacobian(true, rows)
        signal = (true[:, FLUX, None] * rows[:, FLUX]).sum(axis=0)
        cov = np.linalg.inv(jacobian @ jacobian.T)
        noise = rng.normal(0.0, 1.0, signal.size)
        first = ((cov @ (jacobian @ noise)) ** 2 / np.diag(cov))[3:].reshape(2, 3)[:, 1:]
        for sign in (1.0, -1.0):
            data = (signal + sign * noise).reshape(1, *SHAPE)
            win = Windows(data, np.ones_like(data, bool), np.full_like(data, np.inf))
            found = fit_joint(win, true, white)
            assert found.converged
            terms.append(((found.params - true)[:, U:LN_SU] / found.sd[:, 1:]) ** 2 - first)
    # The error to first order has z of variance 1 exactly, and an even part that opposite noise cancels.
    excess = np.array(terms).reshape(PAIRS, 2, 2, 2).mean(axis=1).mean(axis=(1, 2))
    sampling = 4.0 * excess.std() / np.sqrt(PAIRS)
    # Left out, the term is some 10 / 400.
    assert sampling < 0.4 * 10.0 / TOLD
    assert excess.mean() == pytest.approx(0.0, abs=sampling)


@pytest.mark.parametrize("k", [6, 7, 9, 18])
def test_the_inverse_is_that_of_linear_algebra(k: int) -> None:
    rng = np.random.default_rng(k)
    root = rng.normal(size=(k, 3 * k)) * np.logspace(-1, 3, k)[:, None]
    matrix, found = root @ root.T, np.empty((k, k))
    theirs = np.linalg.inv(matrix)
    invert(matrix, found)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    np.testing.assert_allclose(found / scale, theirs / scale, atol=1e-7)


def test_two_spots_at_one_place_have_a_finite_inverse() -> None:
    found = np.empty((2, 2))
    invert(np.ones((2, 2)), found)
    assert np.isfinite(found).all()
