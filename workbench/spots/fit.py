"""Maximum-likelihood fit of many spots at once: Fisher scoring with the variance that the model predicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from workbench.spots.gaussian import BACKGROUND, FLUX, LN_SU, Design, U, Upright
from workbench.spots.noise import Noise, photon_transfer_slope
from workbench.spots.types import Bools, Floats

Model = Callable[[Floats, tuple[int, int]], Design]
_MAX_STEPS: Final = 20
_MAX_STEP: Final = np.array([np.inf, np.inf, 1.0, 1.0, 0.4, 0.4, 0.4])
_MIN_STEP: Final = -_MAX_STEP
# Of both logarithms of the width, and of the shear.
_LOWEST: Final = np.array([np.log(0.15), np.log(0.15), -3.0])
_HIGHEST: Final = np.array([np.log(12.0), np.log(12.0), 3.0])
# Where the steps stop. Near the end a step squares the error: one of 1 sd that is small against the spot too,
# or of 0.1 sd, leaves some hundredths of an sd once it is taken.
_TOLERANCE_SD: Final = 0.1
_SMALL: Final = 0.05
# One window that never converges must not keep the noise of the others from being measured.
_STEPS_TO_MEASURE: Final = 8
# After so many steps it is settled which pixels clip: a set that changes with every step never converges.
_STEPS_TO_SETTLE: Final = 6
# A pixel whose expected value is this near to clipping is left out whatever it reads, else noise would
# choose.
_CLIP_MARGIN_SD: Final = 2.0


@dataclass(frozen=True, slots=True)
class Windows:
    """Equal windows of the signal, one spot each, all arrays (n, height, width)."""

    data: Floats
    """DN."""
    usable: Bools | None = None
    """False where a pixel is clipped, hot or outside the image. None: all are usable."""
    clip_dn: Floats | None = None
    """Value at which the pixel clips. None: nothing is near to it."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.data.shape[1], self.data.shape[2]

    def only(self, index: slice) -> Windows:
        """Some of the windows."""
        usable = None if self.usable is None else self.usable[index]
        return Windows(self.data[index], usable, None if self.clip_dn is None else self.clip_dn[index])


@dataclass(frozen=True, slots=True)
class Fit:
    """Result for n windows. `cov` is that of background, flux, and flux times each further parameter."""

    params: Floats
    """(n, k)."""
    cov: Floats
    """(n, k, k)."""
    design: Design
    signal: Floats
    """(n, height, width), expected value above the background, DN."""
    residual: Floats
    """(n, height, width), DN."""
    weight: Floats
    """(n, height, width), inverse variance, 0 where unused."""
    converged: Bools
    """(n,)."""
    noise: Noise

    @property
    def sd_px(self) -> Floats:
        """(n, 2), standard deviation of the position along u and v."""
        variance = np.maximum(self.cov[:, (2, 3), (2, 3)], 0.0)
        sd: Floats = np.sqrt(variance) / np.maximum(self.params[:, FLUX, None], 1e-12)
        return sd


def _weights(win: Windows, signal: Floats, background: Floats, noise: Noise) -> Floats:
    """Inverse of the variance that the model predicts, 0 where a pixel is not to be used."""
    variance: Floats = np.maximum(signal, 0.0)
    variance *= noise.slope_dn
    variance += noise.floor_dn2
    usable = win.usable
    if usable is not None and win.clip_dn is not None:
        usable = usable & (signal + background < win.clip_dn - _CLIP_MARGIN_SD * np.sqrt(variance))
    weights: Floats = 1.0 / variance
    if usable is not None:
        return weights * usable
    return weights


@lru_cache(maxsize=32)
def _ridge(k: int) -> tuple[Floats, Floats]:
    """Factor and addend of a matrix of k parameters that keep a singular one invertible."""
    return 1.0 + 1e-10 * np.eye(k), 1e-12 * np.eye(k)


def inverse(information: Floats) -> Floats:
    """Inverse of (n, k, k) information matrices; a ridge that only a singular one feels keeps it finite."""
    factor, addend = _ridge(information.shape[1])
    inverted = np.linalg.inv(information * factor + addend)
    return np.asarray(inverted, np.float64)


def _moved(params: Floats, delta: Floats) -> Floats:
    """Parameters after a step, kept from jumping out of the window."""
    k = params.shape[1]
    step = delta.copy()
    step[:, U:] /= np.maximum(np.abs(params[:, FLUX:U]), 1e-9)
    np.minimum(step, _MAX_STEP[:k], out=step)
    np.maximum(step, _MIN_STEP[:k], out=step)
    step += params
    widths = step[:, LN_SU:]
    np.minimum(widths, _HIGHEST[: k - LN_SU], out=widths)
    np.maximum(widths, _LOWEST[: k - LN_SU], out=widths)
    return step


def _at(win: Windows, params: Floats, noise: Noise, model: Model) -> tuple[Design, Floats, Floats, Floats]:
    """The model at `params`: derivatives, expected signal, residual, weights."""
    design = model(params, win.shape)
    signal = params[:, FLUX, None, None] * design.unit
    background = params[:, BACKGROUND, None, None]
    residual = win.data - signal
    residual -= background
    return design, signal, residual, _weights(win, signal, background, noise)


def _solve(design: Design, residual: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Covariance and step."""
    cov = inverse(design.information(weight))
    delta = (cov @ design.gradient(weight * residual)[:, :, None])[:, :, 0]
    if not np.isfinite(delta.sum()):
        delta[~np.isfinite(delta).all(axis=1)] = 0.0
    return cov, delta


def _is_last(delta: Floats, cov: Floats, params: Floats) -> Bools:
    """(n,) whether nothing is left to do once this step has been taken."""
    variance = cov.diagonal(0, 1, 2)
    limit = variance.copy()
    np.minimum(limit[:, U:], (_SMALL * params[:, FLUX:U]) ** 2, out=limit[:, U:])
    np.maximum(limit, _TOLERANCE_SD**2 * variance, out=limit)
    last: Bools = np.logical_and.reduce(delta * delta <= limit, 1)
    return last


def _is_there(delta: Floats, cov: Floats) -> Bools:
    """(n,) whether the residuals are already those of the end; a step to come would still shrink them."""
    there: Bools = np.logical_and.reduce(delta * delta <= _TOLERANCE_SD**2 * cov.diagonal(0, 1, 2), 1)
    return there


def fit_spots(win: Windows, start: Floats, noise: Noise, model: Model = Upright) -> Fit:
    """Fit one spot per window; the photon-transfer slope is measured from the residuals on the way.

    Args:
        win: The windows.
        start: (n, k) first guesses in the order of `gaussian`.
        noise: Floor (trusted) and slope (a first guess).
        model: `Upright` or `Sheared`.
    """
    params, guess, measured = start, noise, False
    for step in range(_MAX_STEPS):
        design, signal, residual, weight = _at(win, params, noise, model)
        cov, delta = _solve(design, residual, weight)
        if not measured and (step == _STEPS_TO_MEASURE or _is_there(delta, cov).all()):
            leverage = design.leverage(cov)
            noise = Noise(guess.floor_dn2, photon_transfer_slope(signal, residual, weight, leverage, guess))
            weight = _weights(win, signal, params[:, BACKGROUND, None, None], noise)
            cov, delta = _solve(design, residual, weight)
            measured = True
        if step == _STEPS_TO_SETTLE and win.clip_dn is not None:
            win = Windows(win.data, weight > 0)
        last = _is_last(delta, cov, params)
        params = _moved(params, delta)
        if measured and last.all():
            break
    return Fit(params, cov, design, signal, residual, weight, last, noise)
