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
    params: FloatArray, along_u: FloatArray, along_v: FloatArray, box: IndexArray, out: FloatArray
) -> None:
    """Fill (height, width): expected value above the background, DN."""
    out[:] = 0.0
    for i in range(len(params)):
        for y in range(box[i, 2], box[i, 3]):
            height = params[i, FLUX] * along_v[i, 0, y]
            for x in range(box[i, 0], box[i, 1]):
                out[y, x] += height * along_u[i, 0, x]


@compiled
def _fill_weights(usable: BoolArray, signal: FloatArray, floor: float, slope: float, out: FloatArray) -> None:
    """Fill the inverse of the variance that the model predicts; 0 for a pixel that is not used."""
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x] = usable[y, x] / (floor + slope * max(signal[y, x], 0.0))


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
    fixed: bool,
    params: FloatArray,
    cov: FloatArray,
    signal: FloatArray,
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
        fixed: Whether `weight` is given; it is filled otherwise.
        params: (k, 6) in the order of `columns`, changed. Background and widths start from the first spot's,
            and are the same for all spots in the end.
        cov: (m, m) filled: covariance of the m = 3 + 3 k parameters of the fit.
        signal: (height, width) filled: expected value above the background, DN; like the arrays below, before
            the last step.
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
        _signal(params, along_u, along_v, box, signal)
        residual[:] = data - signal - params[0, BACKGROUND]
        if not fixed:
            _fill_weights(usable, signal, floor, slope, weight)
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
    return converged and bool(np.isfinite(params).all())
