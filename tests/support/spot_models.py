"""Windows of drawn spots, and the written-out derivatives of spots that are fitted together."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import FloatArray, Image
from workbench.spots import Spot
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR, U, V
from workbench.spots.measure import FittedSpot
from workbench.spots.noise import PixelNoise
from workbench.spots.pair import Pair, PairSignal, measure_signal
from workbench.spots.psf import derivatives
from workbench.spots.strip import Strip

ROUND = np.array([[0.0, 1.0, 7.3, 6.8, np.log(1.1), np.log(1.7)]])
"""(1, 6) an upright ellipse with a flux of 1."""


def pixel_noise(floor_dn2: float, slope_dn: float, windows: int = 1, contrast2: float = 0.0) -> PixelNoise:
    """The same noise in every window; `contrast2` is a first guess."""
    floor, slope, speckle = (np.full(windows, value) for value in (floor_dn2, slope_dn, contrast2))
    return PixelNoise(floor, slope, speckle)


def drawn_windows(params: FloatArray, shape: tuple[int, int], seed: int = 1) -> Windows:
    """A spot a window, in noise with a floor of 4 DN^2 and a photon-transfer slope of 1 DN."""
    rng = np.random.default_rng(seed)
    light = params[:, FLUX, None, None] * derivatives(params, shape)[:, FLUX]
    data = rng.normal(light, np.sqrt(4.0 + np.maximum(light, 0.0)))
    return Windows(data, rng.random(data.shape) < 0.95, np.full(data.shape, np.inf))


def jacobian_of(params: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """(3 + 3 k, pixels): by background, both widths, then flux, u and v of each spot; every pixel."""
    rows = derivatives(params, shape).reshape(*params.shape, -1)
    rows[:, U:] *= params[:, FLUX, None, None]
    own = rows[:, [FLUX, U, V]].reshape(-1, rows.shape[2])
    return np.concatenate([rows[:1, 0], rows[:, LN_SU:SHEAR].sum(axis=0), own])


def scene_of(on: Image, off: Image | None = None, clip_dn: float = 4095.0) -> PairSignal:
    """A whole frame, measured."""
    whole = Strip(slice(0, on.shape[0]), slice(0, on.shape[1]), None)
    return measure_signal(Pair(on, off, clip_dn), whole)


def fitted_spot(
    u_px: float,
    v_px: float,
    width_px: float = 1.3,
    flux_dn: float = 5000.0,
    flux_snr: float = 100.0,
    scene: PairSignal | None = None,
) -> FittedSpot:
    """A round spot as if it had been fitted."""
    sd_px, ln_width = width_px / flux_snr, np.log(width_px)
    peak_dn = flux_dn / (2.0 * np.pi * width_px**2)
    spot = Spot(u_px, v_px, sd_px, sd_px, flux_dn, width_px, peak_dn)
    params = np.array([0.0, flux_dn, u_px, v_px, ln_width, ln_width])
    return FittedSpot(spot, params, 0.1, 0.0, width_px, flux_snr, scene or BLACK)


BLACK = scene_of(np.zeros((60, 120), np.uint16))
"""For spots whose frame does not matter."""
