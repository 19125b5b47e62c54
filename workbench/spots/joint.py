"""Several spots in one window, fitted together: overlapping neighbours, and a blob that is really two."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from workbench.spots.fit import Windows
from workbench.spots.gaussian import FLUX, LN_SU, LN_SV, SHEAR, U, V, derivatives, principal_axes
from workbench.spots.noise import Noise, photon_transfer_slope
from workbench.spots.sums import invert
from workbench.spots.types import Bools, Floats

_MAX_STEPS = 30
_HIDDEN_SD = 5.0
_AROUND = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8)
_MAX_MOVE_PX = 0.7
_MAX_STRETCH = 0.3
_LN_WIDTH_RANGE = (float(np.log(0.3)), float(np.log(12.0)))
_TOLERANCE_SD = 0.1
# As in `judging`; less, for the widths are known from all spots together (docs/spots.md).
_SECOND_ORDER = 10.0


@dataclass(frozen=True, slots=True)
class Joint:
    """Spots of one window that share their widths: lasers of one kind on one target."""

    params: Floats
    """(k, 6) in the order of `gaussian`; background and widths are the same in all rows."""
    sd: Floats
    """(k, 3): of flux, u, v."""
    chi2: float
    """Sum of squared residuals over the variance of the fit that the evidence is asked of."""
    signal: Floats
    """(pixels,) expected value above the background, DN."""
    residual: Floats
    """(pixels,), DN."""
    weight: Floats
    """(pixels,)."""
    noise: Noise
    """With the photon-transfer slope that the residuals tell."""
    converged: bool


def fit_joint(win: Windows, start: Floats, noise: Noise, weight: Floats | None = None) -> Joint:
    """Fit k spots in a single window (n = 1).

    Args:
        win: The window.
        start: (k, 6) first guesses.
        noise: Of the window.
        weight: (pixels,) fixed weights; None: those that the model predicts.
    """
    params = start.copy()
    converged = False
    data = win.data.ravel()
    for _ in range(_MAX_STEPS):
        rows = derivatives(params, win.shape).reshape(*params.shape, -1)
        signal = (params[:, FLUX, None] * rows[:, FLUX]).sum(axis=0)
        used = _weights(win, signal, noise) if weight is None else weight
        residual = data - params[0, 0] - signal
        jacobian = _jacobian(params, rows)
        weighted = jacobian * used
        cov = np.empty((len(jacobian), len(jacobian)))
        invert(weighted @ jacobian.T, cov)
        delta = cov @ (weighted @ residual)
        converged = bool((np.abs(delta) <= _TOLERANCE_SD * np.sqrt(np.maximum(np.diag(cov), 0.0))).all())
        params = _moved(params, delta)
        if converged:
            break
    sd = np.sqrt(np.maximum(np.diag(cov)[3:], 0.0)).reshape(-1, 3)
    sd[:, 1:] = _with_second_order(sd[:, 1:], np.exp(params[:, LN_SU:SHEAR]))
    leverage = ((cov @ jacobian) * jacobian).sum(axis=0)
    one = (1, *win.shape)
    slope = photon_transfer_slope(
        signal.reshape(one), residual.reshape(one), used.reshape(one), leverage.reshape(one), noise
    )
    measured = Noise(noise.floor_dn2, slope)
    return Joint(params, sd, float(used @ residual**2), signal, residual, used, measured, converged)


def _with_second_order(sd_px: Floats, width_px: Floats) -> Floats:
    """(k, 2) deviations of u and v, with the next term of their series in 1 / A, as in `judging`.

    The variance of a spot alone in white noise is 2 width^2 / A; so A is taken from it, for a neighbour that
    overlaps takes a part of what tells away.
    """
    widened: Floats = sd_px * np.sqrt(1.0 + 0.5 * _SECOND_ORDER * (sd_px / width_px) ** 2)
    return widened


def _weights(win: Windows, signal: Floats, noise: Noise) -> Floats:
    weights: Floats = 1.0 / (noise.floor_dn2 + noise.slope_dn * np.maximum(signal, 0.0))
    return weights * win.usable.ravel()


def _jacobian(params: Floats, rows: Floats) -> Floats:
    """(3 + 3 k, pixels): by background, both widths, then flux, u and v of each spot."""
    flux = params[:, FLUX, None]
    shared = [
        np.ones(rows.shape[2]),
        (flux * rows[:, LN_SU]).sum(axis=0),
        (flux * rows[:, LN_SV]).sum(axis=0),
    ]
    own = np.stack([rows[:, FLUX], flux * rows[:, U], flux * rows[:, V]], axis=1)
    return np.concatenate([np.stack(shared), own.reshape(-1, rows.shape[2])])


def _moved(params: Floats, delta: Floats) -> Floats:
    new = params.copy()
    new[:, 0] += delta[0]
    stretched = params[0, LN_SU:SHEAR] + np.clip(delta[1:3], -_MAX_STRETCH, _MAX_STRETCH)
    new[:, LN_SU:SHEAR] = np.clip(stretched, *_LN_WIDTH_RANGE)
    own = delta[3:].reshape(-1, 3)
    new[:, FLUX] = np.maximum(params[:, FLUX] + own[:, 0], 0.1 * np.abs(params[:, FLUX]))
    new[:, U:LN_SU] += np.clip(own[:, 1:], -_MAX_MOVE_PX, _MAX_MOVE_PX)
    return new


def halves(params: Floats) -> Floats:
    """(2, 6) first guess for two spots from the sheared fit (7,) of their sum: apart along its long axis."""
    widths, axes = principal_axes(params)
    apart = max(np.sqrt(widths[1] ** 2 - widths[0] ** 2), 0.4 * widths[1])
    start = np.stack([params[:SHEAR], params[:SHEAR]])
    start[:, FLUX] *= 0.5
    start[:, LN_SU:] = np.log(widths[0])
    start[0, U:LN_SU] -= apart * axes[:, 1]
    start[1, U:LN_SU] += apart * axes[:, 1]
    return start


def evidence(one: float, two: float, pixels: int, parameters: int) -> float:
    """F statistic for three more parameters (a second spot) that lower chi2 from `one` to `two`.

    Dividing by what the larger model leaves unexplained keeps speckle from passing as a second spot.
    """
    left = two / max(pixels - parameters, 1)
    return (one - two) / 3.0 / max(left, 1e-12)


def hidden_spot(joint: Joint, win: Windows, allowed: Bools) -> Floats | None:
    """(6,) first guess of a spot of the same widths that stands out of the residuals; None without one."""
    su, sv = np.exp(joint.params[0, LN_SU:SHEAR])
    weight = joint.weight.reshape(win.shape)
    residual = joint.residual.reshape(win.shape)
    # A pixel that towers over all its neighbours is hot: it counts no more than the highest of them.
    excess = weight * np.minimum(residual, cv2.dilate(residual, _AROUND))
    matched = cv2.GaussianBlur(excess, (0, 0), sigmaX=su, sigmaY=sv, borderType=cv2.BORDER_CONSTANT)
    # The square of a Gaussian is a Gaussian narrower by sqrt(2), of the sum 1 / (4 pi su sv).
    told = cv2.GaussianBlur(
        weight, (0, 0), sigmaX=su / 2**0.5, sigmaY=sv / 2**0.5, borderType=cv2.BORDER_CONSTANT
    )
    told = np.maximum(told / (4.0 * np.pi * su * sv), 1e-12)
    height = np.where(allowed, matched / np.sqrt(told), 0.0)
    row, col = np.unravel_index(int(height.argmax()), win.shape)
    if height[row, col] < _HIDDEN_SD:
        return None
    hidden: Floats = joint.params[0].copy()
    hidden[FLUX], hidden[U], hidden[V] = matched[row, col] / told[row, col], col, row
    return hidden
