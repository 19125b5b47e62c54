"""Joint maximum-likelihood fit of several spots in one window, with common background and widths."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR, U, V
from workbench.spots.kernels.joint import joint_fisher_scoring
from workbench.spots.kernels.joint_sums import OWN, SHARED
from workbench.spots.kernels.photon_transfer import shared_grains
from workbench.spots.kernels.single import LEAST_NOISE_SHARE
from workbench.spots.noise import PixelNoise, measure_noise
from workbench.spots.psf import principal_axes

_HIDDEN_SD = 5.0
_NEIGHBOURS = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8)
# As in `kernels.acceptance`; smaller, because all spots together determine the widths (docs/spots.md).
_SECOND_ORDER = 10.0


@dataclass(frozen=True, slots=True)
class JointFit:
    """Result of a joint fit: spots of one window with common widths (lasers of one kind on one target)."""

    params: FloatArray
    """(k, 6) in the order of `kernels.columns`; background and widths are the same in all rows."""
    sd: FloatArray
    """(k, 3): of flux, u, v; of the position by noise."""
    speckle_sd: FloatArray
    """(k, 2) of u, v by speckle; 0 where the weights were fixed."""
    chi2: float
    """Sum of squared residuals times their weights."""
    signal: FloatArray
    """(height, width) expected value above the background, DN."""
    residual: FloatArray
    """(height, width), DN."""
    weight: FloatArray
    """(height, width) inverse variance, 0 where unused."""
    noise: PixelNoise
    """With slope and contrast measured from the residuals, unless the weights were fixed."""
    converged: bool


def fit_joint(
    win: Windows,
    start: FloatArray,
    noise: PixelNoise,
    weight: FloatArray | None = None,
    assumed: PixelNoise | None = None,
) -> JointFit:
    """Fit k spots in a single window (n = 1).

    Args:
        win: The window.
        start: (k, 6) first guesses.
        noise: Of the window.
        weight: (height, width) fixed weights; None: those that the model predicts.
        assumed: Noise that the measured one is averaged with; None: `noise`.
    """
    params, m = start.copy(), SHARED + OWN * len(start)
    cov, used = np.empty((m, m)), np.empty(win.shape) if weight is None else weight
    signal, mean_square, residual, leverage = (np.empty(win.shape) for _ in range(4))
    by_noise = np.zeros((len(start), 2))
    contrast2 = float(noise.contrast2[0])
    converged = joint_fisher_scoring(
        win.data[0],
        win.usable[0],
        float(noise.floor_dn2[0]),
        float(noise.slope_dn[0]),
        contrast2,
        weight is not None,
        params,
        cov,
        by_noise,
        signal,
        mean_square,
        residual,
        used,
        leverage,
    )
    variance = np.maximum(np.diag(cov)[SHARED:], 0.0).reshape(-1, OWN)
    widened = _second_order(variance[:, 1:], np.exp(params[:, LN_SU:SHEAR]))
    if weight is None:
        noise = measure_noise(
            signal[None], mean_square[None], residual[None], used[None], leverage[None], assumed or noise
        )
    else:
        by_noise = variance[:, 1:]
    by_noise = np.clip(by_noise, LEAST_NOISE_SHARE * variance[:, 1:], variance[:, 1:])  # against rounding
    by_speckle = (variance[:, 1:] - by_noise) * shared_grains(contrast2)
    return JointFit(
        params,
        np.column_stack([np.sqrt(variance[:, 0]), np.sqrt(by_noise) * widened]),
        np.sqrt(by_speckle) * widened,
        float(np.vdot(used, residual**2)),
        signal,
        residual,
        used,
        noise,
        converged,
    )


def _second_order(variance_px2: FloatArray, width_px: FloatArray) -> FloatArray:
    """(k, 2) factor on the standard deviations of u and v by the second term of their series in 1 / A.

    A is the information on the amplitude as in `kernels.acceptance`. It is taken from the variance of each
    coordinate, which is 2 width^2 / A for an isolated spot in white noise; an overlapping neighbour lowers
    it.
    """
    factor: FloatArray = np.sqrt(1.0 + 0.5 * _SECOND_ORDER * variance_px2 / width_px**2)
    return factor


def pair_guess(params: FloatArray) -> FloatArray:
    """(2, 6) first guess of two spots, separated along the long axis of the fit (6,) or (7,) of their sum."""
    widths, axes = principal_axes(params)
    offset = max(np.sqrt(widths[1] ** 2 - widths[0] ** 2), 0.4 * widths[1])
    start = np.stack([params[:SHEAR], params[:SHEAR]])
    start[:, FLUX] *= 0.5
    start[:, LN_SU:] = np.log(widths[0])
    start[0, U:LN_SU] -= offset * axes[:, 1]
    start[1, U:LN_SU] += offset * axes[:, 1]
    return start


def f_statistic(one: float, two: float, pixels: int, parameters: int) -> float:
    """F statistic for three more parameters (a second spot) that lower chi2 from `one` to `two`.

    The denominator is the misfit of the larger model, so that speckle does not count as a second spot.
    """
    left = two / max(pixels - parameters, 1)
    return (one - two) / 3.0 / max(left, 1e-12)


def hidden_spot(joint: JointFit, win: Windows, allowed: BoolArray) -> FloatArray | None:
    """(6,) first guess of a further spot by a matched filter of the residuals; None below 5 sd."""
    su, sv = np.exp(joint.params[0, LN_SU:SHEAR])
    weight, residual = joint.weight, joint.residual
    # A pixel far above all its neighbours is hot: it is limited to the highest of them.
    excess = weight * np.minimum(residual, cv2.dilate(residual, _NEIGHBOURS))
    matched = cv2.GaussianBlur(excess, (0, 0), sigmaX=su, sigmaY=sv, borderType=cv2.BORDER_CONSTANT)
    # The square of a Gaussian is a Gaussian narrower by sqrt(2), with the sum 1 / (4 pi su sv).
    information = cv2.GaussianBlur(
        weight, (0, 0), sigmaX=su / 2**0.5, sigmaY=sv / 2**0.5, borderType=cv2.BORDER_CONSTANT
    )
    information = np.maximum(information / (4.0 * np.pi * su * sv), 1e-12)
    height = np.where(allowed, matched / np.sqrt(information), 0.0)
    row, col = np.unravel_index(int(height.argmax()), win.shape)
    if height[row, col] < _HIDDEN_SD:
        return None
    hidden: FloatArray = joint.params[0].copy()
    hidden[FLUX], hidden[U], hidden[V] = matched[row, col] / information[row, col], col, row
    return hidden
