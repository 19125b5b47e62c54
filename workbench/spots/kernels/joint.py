"""Fisher scoring of several spots in one window with common widths, compiled. Derivation: docs/spots.md.

Order of the parameters of a fit as in `joint_sums`.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.spots.kernels.columns import BACKGROUND, FLUX, LN_SU, U
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.joint_sums import OWN, SHARED, add_pairs, leverages, profiles, sums_alone
from workbench.spots.kernels.single_sums import invert

_MAX_STEPS: Final = 30
_MAX_MOVE_PX: Final = 0.7
_MAX_STRETCH: Final = 0.3
_LN_WIDTH_RANGE: Final = (math.log(0.3), math.log(12.0))
_TOLERANCE_SD: Final = 0.1


@compiled
def _signal(
    params: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    box: IndexArray,
    out: FloatArray,
    mean_square: FloatArray,
) -> None:
    """Fill (height, width): expected value above the background, DN; mean squares of the spots' light, DN^2.

    Lasers do not interfere with each other: the squares are added, not the light.
    """
    out[:], mean_square[:] = 0.0, 0.0
    for i in range(len(params)):
        flux, of_u, of_v = params[i, FLUX], along_u[i], along_v[i]
        for y in range(box[i, 2], box[i, 3]):
            height = flux * of_v[0, y]
            height2 = flux**2 * (of_v[0, y] ** 2 + of_v[1, y] ** 2 / 12.0)
            for x in range(box[i, 0], box[i, 1]):
                out[y, x] += height * of_u[0, x]
                mean_square[y, x] += height2 * (of_u[0, x] ** 2 + of_u[1, x] ** 2 / 12.0)


@compiled
def _fill_weights(
    usable: BoolArray,
    signal: FloatArray,
    mean_square: FloatArray,
    floor: float,
    slope: float,
    contrast2: float,
    out: FloatArray,
) -> None:
    """Fill the inverse of the variance that the model predicts; 0 for a pixel that is not used."""
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            variance = floor + slope * max(signal[y, x], 0.0) + contrast2 * mean_square[y, x]
            out[y, x] = usable[y, x] / variance


@compiled
def _noise_share(
    params: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    box: IndexArray,
    noise: FloatArray,
    cov: FloatArray,
    out: FloatArray,
) -> None:
    """Fill (k, 2): variance of each position by noise; the rest of `cov` is that of speckle.

    `noise` are the squared weights times the variance by noise; see `single.py`.
    """
    m = len(cov)
    information, gradient = np.empty((m, m)), np.empty(m)
    sums_alone(params, along_u, along_v, box, noise, noise, information, gradient)
    add_pairs(params, along_u, along_v, box, noise, information)
    for i in range(len(params)):
        for axis in range(2):
            row = cov[SHARED + OWN * i + 1 + axis]
            out[i, axis] = (row * (information * row).sum(axis=1)).sum()


@compiled
def _apply_step(params: FloatArray, delta: FloatArray) -> None:
    """Apply a limited step to `params` (k, 6); afterwards all spots have the same background and widths."""
    params[:, BACKGROUND] = params[0, BACKGROUND] + delta[0]
    for j in range(2):
        stretched = params[0, LN_SU + j] + min(max(delta[1 + j], -_MAX_STRETCH), _MAX_STRETCH)
        params[:, LN_SU + j] = min(max(stretched, _LN_WIDTH_RANGE[0]), _LN_WIDTH_RANGE[1])
    for i in range(len(params)):
        own = SHARED + OWN * i
        params[i, FLUX] = max(params[i, FLUX] + delta[own], 0.1 * abs(params[i, FLUX]))
        for j in range(2):
            params[i, U + j] += min(max(delta[own + 1 + j], -_MAX_MOVE_PX), _MAX_MOVE_PX)


@compiled
def joint_fisher_scoring(
    data: FloatArray,
    usable: BoolArray,
    floor: float,
    slope: float,
    contrast2: float,
    fixed: bool,
    params: FloatArray,
    cov: FloatArray,
    by_noise: FloatArray,
    signal: FloatArray,
    mean_square: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    leverage: FloatArray,
) -> bool:
    """Fit k spots to a window (height, width), starting at `params`; return whether the fit converged.

    Args:
        data: (height, width), DN.
        usable: (height, width).
        floor: Variance without signal, DN^2.
        slope: Photon-transfer slope, DN.
        contrast2: Squared contrast of speckle.
        fixed: Whether `weight` is given; it is filled otherwise.
        params: (k, 6) in the order of `columns`, changed. Background and widths start from the first spot's,
            and are the same for all spots in the end.
        cov: (m, m) filled: covariance of the m = 3 + 3 k parameters of the fit.
        by_noise: (k, 2) filled: variance of each position by noise, without speckle; unchanged where the
            weights are fixed.
        signal: (height, width) filled: expected value above the background, DN; like the arrays below, before
            the last step.
        mean_square: (height, width) filled: mean square of the spots' light on a pixel, DN^2.
        residual: (height, width) filled, DN.
        weight: (height, width) inverse variance, 0 where unused.
        leverage: (height, width) filled: variance of the fitted pixel values, DN^2; unchanged where the
            weights are fixed.
    """
    k, m = len(params), len(cov)
    along_u, along_v = np.empty((k, 4, data.shape[1])), np.empty((k, 4, data.shape[0]))
    box, information, gradient = np.empty((k, 4), np.intp), np.empty((m, m)), np.empty(m)
    delta = np.empty(m)
    before, converged = params.copy(), False
    for _ in range(_MAX_STEPS):
        before[:] = params
        profiles(params, along_u, along_v, box)
        _signal(params, along_u, along_v, box, signal, mean_square)
        residual[:] = data - signal - params[0, BACKGROUND]
        if not fixed:
            _fill_weights(usable, signal, mean_square, floor, slope, contrast2, weight)
        sums_alone(params, along_u, along_v, box, weight, residual, information, gradient)
        add_pairs(params, along_u, along_v, box, weight, information)
        invert(information, cov)
        converged = True
        for a in range(m):
            delta[a] = 0.0
            for b in range(m):
                delta[a] += cov[a, b] * gradient[b]
            if not abs(delta[a]) <= _TOLERANCE_SD * math.sqrt(max(cov[a, a], 0.0)):
                converged = False
        _apply_step(params, delta)
        if converged:
            break
    if not fixed:
        leverages(before, along_u, along_v, box, cov, leverage)
        noise = weight * (1.0 - weight * contrast2 * mean_square)
        _noise_share(before, along_u, along_v, box, noise, cov, by_noise)
    return converged and bool(np.isfinite(params).all())
