"""Fisher scoring of one spot a window against the written-out normal equations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.spot_models import ROUND, drawn_windows
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import (
    BACKGROUND,
    FLUX,
    FLUX_DEVIATION,
    INFORMATION,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR_SCORE,
    U_DEVIATION,
    V_DEVIATION,
    WORST_EXCESS,
    U,
    V,
)
from workbench.spots.noise import PixelNoise
from workbench.spots.psf import derivatives


@pytest.mark.parametrize("tilted", [False, True])
def test_the_fit_solves_its_equations_as_the_written_out_sums_state_them(tilted: bool) -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    if tilted:
        params = np.append(params, [[0.3], [-0.2]], axis=1)
    win = drawn_windows(params, (11, 13))
    # Fitted from its own end once more, the model moves by less than the step's tolerance.
    start = fit_spots(win, params, PixelNoise(np.full(2, 4.0), np.ones(2))).params
    fit = fit_spots(win, start, PixelNoise(np.full(2, 4.0), np.ones(2)))
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


def test_a_window_is_accepted_by_numbers_that_numpy_finds_as_well() -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    win = drawn_windows(params, (11, 13))
    fit = fit_spots(win, params, PixelNoise(np.full(2, 4.0), np.ones(2)))
    excess = fit.residual**2 * fit.weight
    rim = np.ones((11, 13), bool)
    rim[1:-1, 1:-1] = False
    used = (fit.weight[:, rim] > 0).sum(axis=1)
    flux = fit.params[:, FLUX]
    expected = {
        WORST_EXCESS: excess.max(axis=(1, 2)),
        RIM_NOISE: excess[:, rim].sum(axis=1) / used,
        RIM_PIXELS: used,
        PEAK_DN: fit.signal.max(axis=(1, 2)),
        INFORMATION: (fit.weight * fit.signal**2).sum(axis=(1, 2)),
        FLUX_DEVIATION: np.sqrt(fit.cov[:, FLUX, FLUX]),
    }
    for column, values in expected.items():
        np.testing.assert_allclose(fit.statistics[:, column], values, rtol=1e-9)
    for column, parameter in ((U_DEVIATION, U), (V_DEVIATION, V)):
        deviation = np.sqrt(fit.cov[:, parameter, parameter]) / flux
        # The flux of the last step: its own deviation away at most.
        np.testing.assert_allclose(fit.statistics[:, column], deviation, rtol=1e-2)


def test_a_pixel_that_may_be_clipped_is_excluded_at_any_value() -> None:
    """Those expected within 2 sd of clipping, not those that read so."""
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    win = drawn_windows(params, (15, 15))
    clip_dn = 0.6 * float((4e4 * derivatives(params, (15, 15))[0, FLUX]).max())
    clipped = win._replace(clip_dn=np.full_like(win.data, clip_dn), usable=win.usable & (win.data < clip_dn))
    fit = fit_spots(clipped, params, PixelNoise(np.full(1, 4.0), np.ones(1)))
    assert fit.converged.all()
    sd = np.sqrt(4.0 + fit.slope_dn[0] * np.maximum(fit.signal, 0.0))
    near = fit.signal + fit.params[:, BACKGROUND, None, None] > clip_dn - 2.0 * sd
    assert near.any()
    assert (fit.weight[near] == 0.0).all()
    assert fit.params[0, [U, V]] == pytest.approx(params[0, [U, V]], abs=0.05)


def test_the_score_of_the_shear_detects_a_tilted_ellipse() -> None:
    upright = ROUND.copy()
    upright[:, FLUX] = 4e4
    tilted = np.append(upright, [[0.3]], axis=1)
    noise = PixelNoise(np.full(1, 4.0), np.ones(1))
    scores = [
        fit_spots(drawn_windows(p, (15, 15)), upright, noise).statistics[0, SHEAR_SCORE]
        for p in (upright, tilted)
    ]
    assert scores[0] < 5.0**2 < scores[1]
