"""Maximum-likelihood fit of many spots at once, by Fisher scoring with the variance that the model predicts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.spots.gaussian import Param, basis
from workbench.spots.types import Bools, Floats

_MAX_STEPS = 12
_MAX_MOVE_PX = 1.0
_MAX_STRETCH = 0.4
_LN_WIDTH_RANGE = (np.log(0.2), np.log(12.0))
# Where the steps stop: the rest of the way is this share of the standard deviation.
_TOLERANCE_SD = 0.05
# A pixel whose expected value is this near to clipping is left out whatever it reads, else noise would choose.
_CLIP_MARGIN_SD = 2.0
# The first photon-transfer guess weighs like this many pixels against the measured residuals.
_PRIOR_PIXELS = 2.0


@dataclass(frozen=True)
class Noise:
    """Variance of a pixel as a straight line over its expected signal (photon transfer)."""

    floor_dn2: float
    """Variance without signal, DN^2."""
    slope_dn: float
    """Variance per signal, DN^2 / DN."""


@dataclass(frozen=True)
class Windows:
    """Equal windows cut out of the difference image, one spot each."""

    data: Floats
    """(n, height * width), DN."""
    usable: Bools
    """(n, height * width), False where a pixel is clipped, hot or outside the image."""
    shape: tuple[int, int]
    clip_dn: Floats
    """(n, height * width): the difference at which the on-frame's pixel clips."""


@dataclass(frozen=True)
class Fitted:
    """Result of a fit; the window's frame, see `Param`."""

    params: Floats
    """(n, 6)."""
    cov: Floats
    """(n, 6, 6), of background, flux, flux times the others."""
    residual: Floats
    """(n, pixels), DN."""
    weight: Floats
    """(n, pixels), inverse variance, 0 where unused."""
    basis: Floats
    converged: Bools
    """(n,)."""
    noise: Noise


def _linearise(win: Windows, params: Floats, noise: Noise) -> tuple[Floats, Floats, Floats, Floats]:
    """Basis, weights, residuals and information matrix at `params`."""
    rows = basis(params, win.shape)
    signal = np.maximum(params[:, Param.FLUX, None], 0.0) * rows[:, Param.FLUX]
    variance = noise.floor_dn2 + noise.slope_dn * signal
    background = params[:, Param.BACKGROUND, None]
    usable = win.usable & (signal + background < win.clip_dn - _CLIP_MARGIN_SD * np.sqrt(variance))
    weight = usable / variance
    residual = win.data - background - params[:, Param.FLUX, None] * rows[:, Param.FLUX]
    weighted = rows * weight[:, None]
    information = weighted @ rows.transpose(0, 2, 1)
    return rows, weight, residual, information


def _regularised(information: Floats) -> Floats:
    """The matrix with a ridge that only a singular one feels."""
    diagonal = np.einsum("nii->ni", information)
    ridge = 1e-9 * diagonal + 1e-12 * diagonal.max(axis=1, keepdims=True) + 1e-30
    return information + ridge[:, :, None] * np.eye(information.shape[1])


def _step(params: Floats, delta: Floats) -> Floats:
    """Parameters after a scoring step, kept from jumping out of the window."""
    new = params.copy()
    new[:, :2] += delta[:, :2]
    flux = np.maximum(np.abs(params[:, Param.FLUX]), 1e-9)[:, None]
    new[:, 2:4] += np.clip(delta[:, 2:4] / flux, -_MAX_MOVE_PX, _MAX_MOVE_PX)
    stretched = new[:, 4:] + np.clip(delta[:, 4:] / flux, -_MAX_STRETCH, _MAX_STRETCH)
    new[:, 4:] = np.clip(stretched, *_LN_WIDTH_RANGE)
    return new


def _score(win: Windows, params: Floats, noise: Noise) -> Fitted:
    """Scoring steps until the steps are far below the standard deviation, or `_MAX_STEPS`."""
    converged = np.zeros(len(params), bool)
    for _ in range(_MAX_STEPS):
        rows, weight, residual, information = _linearise(win, params, noise)
        cov = np.linalg.inv(_regularised(information))
        gradient = (rows @ (weight * residual)[:, :, None])[:, :, 0]
        delta = (cov @ gradient[:, :, None])[:, :, 0]
        small = np.abs(delta) < _TOLERANCE_SD * np.sqrt(np.abs(np.einsum("nii->ni", cov)))
        converged = small.all(axis=1)
        params = np.where(np.isfinite(delta).all(axis=1, keepdims=True), _step(params, delta), params)
        if converged.all():
            break
    return Fitted(params, cov, residual, weight, rows, converged, noise)


def photon_transfer_slope(fit: Fitted) -> float:
    """Variance per signal (DN) measured from the residuals of all spots of the frame.

    Each squared residual exceeds the floor by slope times signal, less what the fit has absorbed (its leverage).
    Weighted moments give the slope; few informative pixels are weighed against the slope assumed so far, and the
    factor n / (n - 2) makes the deviation honest on average when n pixels tell the slope (Student).
    """
    absorbed = np.einsum("nip,nij,njp->np", fit.basis, fit.cov, fit.basis, optimize=True) * fit.weight
    kept = np.clip(1.0 - absorbed, 0.0, 1.0)
    signal = np.maximum(fit.params[:, Param.FLUX, None], 0.0) * fit.basis[:, Param.FLUX]
    leverage = signal * fit.weight**2
    floor, slope = fit.noise.floor_dn2, fit.noise.slope_dn
    told = float((leverage * signal * kept).sum())
    excess = float((leverage * (fit.residual**2 - floor * kept)).sum())
    if told <= 0.0:
        return slope
    measured = max(excess / told, 0.0)
    pixels = told * max(measured, slope) ** 2
    total = pixels + _PRIOR_PIXELS
    return (pixels * measured + _PRIOR_PIXELS * slope) / max(total - 2.0, 0.5 * total)


def fit_spots(win: Windows, start: Floats, noise: Noise) -> Fitted:
    """Fit one spot per window and measure the photon-transfer slope on the way.

    Args:
        win: The windows.
        start: (n, 6) first guesses, see `Param`.
        noise: Floor (trusted) and slope (first guess).
    """
    first = _score(win, start, noise)
    measured = Noise(noise.floor_dn2, photon_transfer_slope(first))
    return _score(win, first.params, measured)
