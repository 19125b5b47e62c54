"""Faint spots: where the inverse of the Fisher matrix is not the whole story, and noise looks like spots."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from workbench.model.arrays import FloatArray
from workbench.spots import find_spots
from workbench.spots.kernels.acceptance import _SECOND_ORDER
from workbench.spots.kernels.columns import FLUX, U
from workbench.spots.psf import derivatives

WIDTH, HALF, NOISE_SD = 4.0, 19, 1.0
SHAPE = (2 * HALF + 1, 2 * HALF + 1)
PAIRS, TOLD, STEPS = 1200, 400.0, 8


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
    flux = np.sqrt(TOLD * 4.0 * np.pi) * WIDTH * NOISE_SD
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
            terms.append(TOLD * (z - first))
    pairs = np.array(terms).reshape(-1, 2, 100, 2).mean(axis=1)
    sampling = 4.0 * pairs.std() / np.sqrt(pairs.size)
    assert sampling < 0.3 * _SECOND_ORDER
    assert pairs.mean() == pytest.approx(_SECOND_ORDER, abs=sampling)


@pytest.mark.parametrize(("seed", "number"), [(11, 448), (11, 1369), (1, 195)])
def test_a_spike_of_noise_is_not_taken_for_the_wide_spot_under_it(seed: int, number: int) -> None:
    # Frames on which a narrow fit in a small window settles 6 to 31 of its deviations from the spot.
    rng = np.random.default_rng([seed, 400, 1000])
    phases = rng.uniform(-0.5, 0.5, (2000, 2))
    for phase in phases[: number + 1]:
        true = Drawn(40 + phase[0], 40 + phase[1], 1e3, 4.0, 4.0)
        frame = draw([true], rng, (81, 81), Sensor(), 5.0)
    (spot,) = find_spots(frame, saturation_dn=4095).spots
    assert spot.width_px > 2.5
    assert abs(spot.u_px - true.u) < 4 * spot.u_sd_px
    assert abs(spot.v_px - true.v) < 4 * spot.v_sd_px
