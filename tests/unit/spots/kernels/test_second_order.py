"""Second order of a stated deviation, where the inverse of the Fisher matrix is not the whole story."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.acceptance import _SECOND_ORDER
from workbench.spots.kernels.columns import FLUX, U
from workbench.spots.psf import derivatives

WIDTH, HALF, NOISE_SD = 4.0, 19, 1.0
SHAPE = (2 * HALF + 1, 2 * HALF + 1)
PAIRS, INFORMATION, STEPS = 1200, 400.0, 8


def linearised(params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Signal (n, pixels), derivatives by all six parameters (n, 6, pixels), inverse Fisher matrix."""
    rows = derivatives(params, SHAPE).reshape(*params.shape, -1)
    signal = params[:, FLUX, None] * rows[:, FLUX]
    rows[:, U:] *= params[:, FLUX, None, None]
    return signal, rows, np.asarray(np.linalg.inv(rows @ rows.transpose(0, 2, 1)), np.float64)


def fitted(data: FloatArray, start: FloatArray) -> FloatArray:
    """Least squares, which is maximum likelihood where the noise is white."""
    params = start.copy()
    for _ in range(STEPS):
        signal, rows, cov = linearised(params)
        residual = data - signal - params[:, :1]
        params += (cov @ (rows @ residual[:, :, None]))[:, :, 0]
    return params


def test_the_second_order_of_the_deviation_is_that_of_simulated_fits() -> None:
    rng = np.random.default_rng(1)
    flux = np.sqrt(INFORMATION * 4.0 * np.pi) * WIDTH * NOISE_SD
    terms = []
    for _ in range(PAIRS // 100):
        true = np.zeros((100, 6))
        true[:, FLUX], true[:, 4:] = flux, np.log(WIDTH)
        true[:, U:4] = HALF + rng.uniform(-0.5, 0.5, (100, 2))
        signal, rows, cov = linearised(true)
        noise = rng.normal(0.0, NOISE_SD, signal.shape)
        # The error to first order has z of variance 1 exactly, and an even part that opposite noise cancels.
        first = (cov @ (rows @ noise[:, :, None]))[:, U:4, 0] ** 2 / cov[:, [2, 3], [2, 3]]
        for sign in (1.0, -1.0):
            params = fitted(signal + sign * noise, true)
            z = (params - true)[:, U:4] ** 2 / linearised(params)[2][:, [2, 3], [2, 3]]
            terms.append(INFORMATION * (z - first))
    pairs = np.array(terms).reshape(-1, 2, 100, 2).mean(axis=1)
    sampling = 4.0 * pairs.std() / np.sqrt(pairs.size)
    assert sampling < 0.3 * _SECOND_ORDER
    assert pairs.mean() == pytest.approx(_SECOND_ORDER, abs=sampling)
