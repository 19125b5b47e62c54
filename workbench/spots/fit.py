"""Maximum-likelihood fit of many spots at once: Fisher scoring with the variance that the model predicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.spots.gaussian import BACKGROUND, FLUX, LN_SU, U, upright
from workbench.spots.noise import Noise, photon_transfer_slope
from workbench.spots.types import Bools, Floats

Basis = Callable[[Floats, tuple[int, int]], Floats]
_MAX_STEPS = 15
_MAX_MOVE = 1.0
_MAX_STRETCH = 0.4
_LN_WIDTH_RANGE = (float(np.log(0.15)), float(np.log(12.0)))
# Where the steps stop: the last step was this share of the standard deviation, the next is far below.
_TOLERANCE_SD = 0.1
# A pixel whose expected value is this near to clipping is left out whatever it reads, else noise would choose.
_CLIP_MARGIN_SD = 2.0


@dataclass(frozen=True, slots=True)
class Windows:
    """Equal windows of the difference image, one spot each."""

    data: Floats
    """(n, height * width), DN."""
    shape: tuple[int, int]
    usable: Bools | None = None
    """(n, height * width), False where a pixel is clipped, hot or outside the image. None: all are usable."""
    clip_dn: Floats | None = None
    """(n, height * width), value at which the pixel clips. None: nothing is near to it."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Result for n windows. `cov` is that of background, flux, and flux times each further parameter."""

    params: Floats
    """(n, k)."""
    cov: Floats
    """(n, k, k)."""
    rows: Floats
    """(n, k, pixels), the basis."""
    residual: Floats
    """(n, pixels), DN."""
    weight: Floats
    """(n, pixels), inverse variance, 0 where unused."""
    converged: Bools
    """(n,)."""
    noise: Noise

    @property
    def signal(self) -> Floats:
        """(n, pixels), expected value above the background, DN."""
        signal: Floats = self.params[:, FLUX, None] * self.rows[:, FLUX]
        return signal

    @property
    def leverage(self) -> Floats:
        """(n, pixels), the share of each pixel's variance that the fit absorbs."""
        absorbed: Floats = ((self.cov @ self.rows) * self.rows).sum(axis=1) * self.weight
        return absorbed

    @property
    def sd_px(self) -> Floats:
        """(n, 2), standard deviation of the position along u and v."""
        variance = np.maximum(self.cov[:, (2, 3), (2, 3)], 0.0)
        sd: Floats = np.sqrt(variance) / np.maximum(self.params[:, FLUX, None], 1e-12)
        return sd


def _weights(win: Windows, signal: Floats, background: Floats, noise: Noise) -> Floats:
    """Inverse of the variance that the model predicts, 0 where a pixel is not to be used."""
    variance = noise.floor_dn2 + noise.slope_dn * np.maximum(signal, 0.0)
    if win.usable is None:
        return 1.0 / variance
    usable = win.usable
    if win.clip_dn is not None:
        usable = usable & (signal + background < win.clip_dn - _CLIP_MARGIN_SD * np.sqrt(variance))
    weights: Floats = usable / variance
    return weights


def inverse(information: Floats) -> Floats:
    """Inverse of (n, k, k) information matrices; a ridge that only a singular one feels keeps it finite."""
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("nii->ni", information), 1e-30))
    outer = scale[:, :, None] * scale[:, None, :]
    scaled = information * outer
    scaled += 1e-10 * np.eye(information.shape[1])
    inverted: Floats = np.linalg.inv(scaled) * outer
    return inverted


def _moved(params: Floats, delta: Floats) -> Floats:
    """Parameters after a step, kept from jumping out of the window."""
    new = params.copy()
    new[:, :U] += delta[:, :U]
    step = delta[:, U:] / np.maximum(np.abs(params[:, FLUX, None]), 1e-9)
    new[:, U:LN_SU] += np.clip(step[:, :2], -_MAX_MOVE, _MAX_MOVE)
    new[:, LN_SU:] += np.clip(step[:, 2:], -_MAX_STRETCH, _MAX_STRETCH)
    np.clip(new[:, LN_SU : LN_SU + 2], *_LN_WIDTH_RANGE, out=new[:, LN_SU : LN_SU + 2])
    return new


def score(win: Windows, start: Floats, noise: Noise, basis: Basis) -> Fit:
    """Scoring steps from `start` (n, k) until they are far below the standard deviation."""
    params = start
    for _ in range(_MAX_STEPS):
        rows = basis(params, win.shape)
        signal = params[:, FLUX, None] * rows[:, FLUX]
        background = params[:, BACKGROUND, None]
        weight = _weights(win, signal, background, noise)
        residual = win.data - background - signal
        weighted = rows * weight[:, None]
        cov = inverse(weighted @ rows.transpose(0, 2, 1))
        delta = (cov @ (weighted @ residual[:, :, None]))[:, :, 0]
        spread = np.sqrt(np.maximum(np.einsum("nii->ni", cov), 0.0))
        converged = (np.abs(delta) <= _TOLERANCE_SD * spread).all(axis=1)
        params = _moved(params, delta)
        if converged.all():
            break
    return Fit(params, cov, rows, residual, weight, converged, noise)


def measured_noise(fit: Fit) -> Noise:
    """The noise of `fit` with its slope measured from the residuals."""
    slope = photon_transfer_slope(
        np.maximum(fit.signal, 0.0), fit.residual, fit.weight, fit.leverage, fit.noise
    )
    return Noise(fit.noise.floor_dn2, slope)


def fit_spots(win: Windows, start: Floats, noise: Noise, basis: Basis = upright) -> Fit:
    """Fit one spot per window, and measure the photon-transfer slope on the way.

    Args:
        win: The windows.
        start: (n, k) first guesses in the order of `gaussian`.
        noise: Floor (trusted) and slope (a first guess).
        basis: `upright` or `sheared`.
    """
    first = score(win, start, noise, basis)
    return score(win, first.params, measured_noise(first), basis)
