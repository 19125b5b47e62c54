"""Sums of a fit of one spot, and the inverse of its matrix, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.kernels.single_sums import invert


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
