"""Fisher scoring of one spot a window against the written-out normal equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.spot_models import ROUND, drawn_windows, pixel_noise
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import (
    BACKGROUND,
    FLUX,
    FLUX_DEVIATION,
    FLUX_NOISE,
    INFORMATION,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR_SCORE,
    U_DEVIATION,
    U_SPECKLE,
    V_DEVIATION,
    V_SPECKLE,
    WORST_EXCESS,
    U,
    V,
)
from workbench.spots.kernels.photon_transfer import shared_grains
from workbench.spots.psf import derivatives


@pytest.mark.parametrize("tilted", [False, True])
@pytest.mark.parametrize("contrast2", [0.0, 0.03])
def test_the_fit_solves_its_equations_as_the_written_out_sums_state_them(
    tilted: bool, contrast2: float
) -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    if tilted:
        params = np.append(params, [[0.3], [-0.2]], axis=1)
    win = drawn_windows(params, (11, 13))
    # Fitted from its own end once more, with its own noise, it moves by less than the step's tolerance.
    fit = fit_spots(win, params, replace(pixel_noise(4.0, 1.0, 2, contrast2), stated_contrast2=contrast2))
    for _ in range(2):
        start = fit.params
        fit = fit_spots(win, start, fit.noise)
    assert fit.converged.all()
    rows = derivatives(start, (11, 13)).reshape(2, params.shape[1], -1)
    signal = start[:, FLUX, None] * rows[:, FLUX]
    square = signal**2 + ((start[:, FLUX, None, None] * rows[:, U : V + 1]) ** 2).sum(axis=1) / 12.0
    if not tilted:  # the product of both profiles' mean squares
        share = np.maximum(rows[:, FLUX], 1e-300)
        square += (start[:, FLUX, None] * rows[:, U] * rows[:, V] / share) ** 2 / 144.0
    noise = fit.noise
    variance = 4.0 + noise.slope_dn[:, None] * np.maximum(signal, 0.0) + noise.contrast2[:, None] * square
    weight = win.usable.reshape(2, -1) / variance
    information = (rows * weight[:, None]) @ rows.transpose(0, 2, 1)
    residual = win.data.reshape(2, -1) - signal - start[:, BACKGROUND, None]
    step = np.linalg.solve(information, rows @ (weight * residual)[:, :, None])[:, :, 0]
    step[:, U:] /= start[:, FLUX, None]
    np.testing.assert_allclose(fit.params, start + step, rtol=1e-6, atol=1e-7)
    cov = np.linalg.inv(information)
    np.testing.assert_allclose(fit.cov, cov, rtol=1e-4)
    by_speckle = noise.contrast2[:, None] * square / variance
    share = cov @ (rows * (weight * by_speckle)[:, None]) @ rows.transpose(0, 2, 1) @ cov
    flux_noise = cov[:, FLUX, FLUX] - share[:, FLUX, FLUX]
    np.testing.assert_allclose(fit.statistics[:, FLUX_NOISE] ** 2, flux_noise, rtol=1e-3)
    for column, of_speckle, parameter in ((U_DEVIATION, U_SPECKLE, U), (V_DEVIATION, V_SPECKLE, V)):
        flux2 = fit.params[:, FLUX] ** 2
        total = cov[:, parameter, parameter] / flux2
        speckle = share[:, parameter, parameter] / flux2
        np.testing.assert_allclose(fit.statistics[:, column] ** 2, total - speckle, rtol=1e-3)
        grains = [shared_grains(c) for c in noise.contrast2]
        stated = fit.statistics[:, of_speckle] ** 2
        np.testing.assert_allclose(stated, speckle * grains, rtol=1e-3, atol=1e-10)


def test_a_window_is_accepted_by_numbers_that_numpy_finds_as_well() -> None:
    params = np.vstack([ROUND, ROUND + 0.1])
    params[:, FLUX] = 4e4, 3e4
    win = drawn_windows(params, (11, 13))
    fit = fit_spots(win, params, pixel_noise(4.0, 1.0, 2))
    excess = fit.residual**2 * fit.weight
    noise_weight = (fit.weight > 0) / (4.0 + fit.noise.slope_dn[:, None, None] * np.maximum(fit.signal, 0.0))
    rim = np.ones((11, 13), bool)
    rim[1:-1, 1:-1] = False
    used = (fit.weight[:, rim] > 0).sum(axis=1)
    expected = {
        WORST_EXCESS: excess.max(axis=(1, 2)),
        RIM_NOISE: excess[:, rim].sum(axis=1) / used,
        RIM_PIXELS: used,
        PEAK_DN: fit.signal.max(axis=(1, 2)),
        INFORMATION: (noise_weight * fit.signal**2).sum(axis=(1, 2)),
        FLUX_DEVIATION: np.sqrt(fit.cov[:, FLUX, FLUX]),
    }
    for column, values in expected.items():
        np.testing.assert_allclose(fit.statistics[:, column], values, rtol=1e-9)


def test_a_pixel_that_may_be_clipped_is_excluded_at_any_value() -> None:
    """Those expected within 2 sd of clipping, not those that read so."""
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    win = drawn_windows(params, (15, 15))
    clip_dn = 0.6 * float((4e4 * derivatives(params, (15, 15))[0, FLUX]).max())
    clipped = win._replace(clip_dn=np.full_like(win.data, clip_dn), usable=win.usable & (win.data < clip_dn))
    fit = fit_spots(clipped, params, pixel_noise(4.0, 1.0))
    assert fit.converged.all()
    sd = np.sqrt(4.0 + fit.noise.slope_dn[0] * np.maximum(fit.signal, 0.0))
    near = fit.signal + fit.params[:, BACKGROUND, None, None] > clip_dn - 2.0 * sd
    assert near.any()
    assert (fit.weight[near] == 0.0).all()
    assert fit.params[0, [U, V]] == pytest.approx(params[0, [U, V]], abs=0.05)


def test_the_score_of_the_shear_detects_a_tilted_ellipse() -> None:
    upright = ROUND.copy()
    upright[:, FLUX] = 4e4
    tilted = np.append(upright, [[0.3]], axis=1)
    noise = pixel_noise(4.0, 1.0)
    scores = [
        fit_spots(drawn_windows(p, (15, 15)), upright, noise).statistics[0, SHEAR_SCORE]
        for p in (upright, tilted)
    ]
    assert scores[0] < 5.0**2 < scores[1]
