"""Fisher scoring of one spot a window against the written-out normal equations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.spot_models import ROUND, drawn_windows
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import BACKGROUND, FLUX, U
from workbench.spots.noise import Noise
from workbench.spots.psf import derivatives


@pytest.mark.parametrize("tilted", [False, True])
def test_the_fit_solves_its_equations_as_the_written_out_sums_state_them(tilted: bool) -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    if tilted:
        params = np.append(params, [[0.3], [-0.2]], axis=1)
    win = drawn_windows(params, (11, 13))
    # Fitted from its own end once more, the model moves by less than the step's tolerance.
    start = fit_spots(win, params, Noise(np.full(2, 4.0), np.ones(2))).params
    fit = fit_spots(win, start, Noise(np.full(2, 4.0), np.ones(2)))
    assert fit.converged.all()
    rows = derivatives(start, (11, 13)).reshape(2, params.shape[1], -1)
    signal = start[:, FLUX, None] * rows[:, FLUX]
    weight = win.usable.reshape(2, -1) / (4.0 + fit.slope_dn[:, None] * np.maximum(signal, 0.0))
    information = (rows * weight[:, None]) @ rows.transpose(0, 2, 1)
    residual = win.data.reshape(2, -1) - signal - start[:, BACKGROUND, None]
    step = np.linalg.solve(information, rows @ (weight * residual)[:, :, None])[:, :, 0]
    step[:, U:] /= start[:, FLUX, None]
    np.testing.assert_allclose(fit.params, start + step, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(fit.cov, np.linalg.inv(information), rtol=1e-4)
