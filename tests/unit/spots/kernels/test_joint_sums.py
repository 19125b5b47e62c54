"""Sums of a joint fit against derivatives that are written out."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.spot_models import jacobian_of
from workbench.spots.kernels.columns import FLUX, LN_SU, LN_SV, U, V
from workbench.spots.kernels.joint_sums import add_pairs, leverages, profiles, sums_alone


@pytest.mark.parametrize("k", [1, 2, 4])
def test_the_sums_of_a_joint_fit_are_those_of_its_derivatives(k: int) -> None:
    rng, shape = np.random.default_rng(k), (25, 31)
    params = np.zeros((k, 6))
    params[:, FLUX] = rng.uniform(100.0, 5000.0, k)
    # Two that overlap, one that the border of the window cuts, one by itself.
    params[:, U] = (12.3, 15.1, 30.4, 4.0)[:k]
    params[:, V] = (11.8, 13.0, 1.2, 24.6)[:k]
    params[:, LN_SU], params[:, LN_SV] = np.log(1.1), np.log(1.7)
    weight, residual = rng.uniform(0.0, 1.0, shape), rng.normal(0.0, 3.0, shape)
    weight[rng.uniform(size=shape) < 0.2] = 0.0
    dense = jacobian_of(params, shape)
    m = len(dense)
    along_u, along_v, box = np.empty((k, 4, shape[1])), np.empty((k, 4, shape[0])), np.empty((k, 4), np.intp)
    information, gradient, leverage = np.empty((m, m)), np.empty(m), np.empty(shape)
    profiles(params, along_u, along_v, box)
    sums_alone(params, along_u, along_v, box, weight, residual, information, gradient)
    add_pairs(params, along_u, along_v, box, weight, information)
    expected = (dense * weight.ravel()) @ dense.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Light beyond five widths is left out: a millionth, which a derivative by the width weighs by z^2.
    np.testing.assert_allclose(information / scale, expected / scale, atol=1e-5)
    pulled = dense @ (weight * residual).ravel()
    np.testing.assert_allclose((gradient - pulled) / np.sqrt(np.diag(expected)), 0.0, atol=1e-4)
    root = rng.normal(size=(m, 2 * m))
    cov = root @ root.T / scale
    leverages(params, along_u, along_v, box, cov, leverage)
    theirs = ((cov @ dense) * dense).sum(axis=0).reshape(shape)
    np.testing.assert_allclose(leverage, theirs, atol=1e-5 * theirs.max())
