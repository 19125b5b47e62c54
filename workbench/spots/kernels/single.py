"""Fisher scoring of one spot per window, all windows in one compiled call. Derivation: docs/spots.md."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.columns import (
    BACKGROUND,
    FLUX,
    FLUX_DEVIATION,
    FLUX_NOISE,
    INFORMATION,
    LN_SU,
    LN_SV,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR_SCORE,
    U_DEVIATION,
    U_SPECKLE,
    WORST_EXCESS,
    U,
    V,
)
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.photon_transfer import measure_variance, shared_grains
from workbench.spots.kernels.profiles import profile, sheared_rows, upright_rows
from workbench.spots.kernels.single_sums import dense_sums, fill_leverage, invert, separable_sums

_MAX_STEPS: Final = 20
_MAX_STEP: Final = np.array([math.inf, math.inf, 1.0, 1.0, 0.4, 0.4, 0.4])
# Limits of ln width along u and v, and of the shear.
_LOWEST: Final = np.array([math.log(0.15), math.log(0.15), -3.0])
_HIGHEST: Final = np.array([math.log(12.0), math.log(12.0), 3.0])
# Convergence: a last step of 0.1 sd, or of 1 sd if it is below 5 % of the spot, too. Convergence is
# quadratic: after that step the error is some hundredths of an sd.
_TOLERANCE_SD: Final = 0.1
_SMALL_STEP: Final = 0.05
# Step after which the noise is measured even if a window has not converged.
_STEPS_TO_MEASURE: Final = 8
# Step after which the set of clipped pixels is fixed: a set that changes with every step prevents
# convergence.
_STEPS_TO_SETTLE: Final = 6
# Margin between a pixel's expected value and clipping. Closer pixels are excluded, clipped or not: a choice
# by the data would be a choice by noise.
_CLIP_MARGIN_SD: Final = 2.0
# Least share of noise in the variance of a position.
LEAST_NOISE_SHARE: Final = 1e-6


@compiled
def _fill_weights(
    usable: BoolArray,
    clip: FloatArray,
    signal: FloatArray,
    mean_square: FloatArray,
    background: float,
    floor: float,
    slope: float,
    contrast2: float,
    out: FloatArray,
) -> None:
    """Fill the inverse of the variance that the model predicts; 0 for a pixel that is not used."""
    lowest_clip = math.inf
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            variance = floor + slope * max(signal[y, x], 0.0) + contrast2 * mean_square[y, x]
            out[y, x] = usable[y, x] / variance
            lowest_clip = min(lowest_clip, clip[y, x])
    if lowest_clip == math.inf:
        return
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            if clip[y, x] < math.inf:
                variance = floor + slope * max(signal[y, x], 0.0) + contrast2 * mean_square[y, x]
                margin = clip[y, x] - signal[y, x] - background
                if not margin > _CLIP_MARGIN_SD * math.sqrt(variance):
                    out[y, x] = 0.0


@compiled
def _apply_step(params: FloatArray, delta: FloatArray) -> None:
    """Apply a limited step to the parameters of one window."""
    flux = max(abs(params[FLUX]), 1e-9)
    for j in range(params.size):
        step = delta[j] / flux if j > 1 else delta[j]
        params[j] += min(max(step, -_MAX_STEP[j]), _MAX_STEP[j])
        if j > 3:
            params[j] = min(max(params[j], _LOWEST[j - 4]), _HIGHEST[j - 4])


@compiled
def _within(delta: FloatArray, cov: FloatArray, small: float) -> bool:
    """Whether a step is within 0.1 sd, or within 1 sd and `small` (DN)."""
    for j in range(delta.size):
        variance = cov[j, j]
        limit = variance if small > 0.0 else 0.0
        if j > 1:
            limit = min(limit, small * small)
        if not delta[j] * delta[j] <= max(limit, _TOLERANCE_SD**2 * variance):
            return False
    return True


@compiled
def _evaluate(
    params: FloatArray,
    data: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    rows: FloatArray,
    signal: FloatArray,
    mean_square: FloatArray,
    residual: FloatArray,
) -> None:
    """Fill profiles (or derivatives of a tilted ellipse), and the pixels of one window at `params`.

    The mean square of the light on a pixel is the square of its mean, and a twelfth of that of its slope.
    """
    flux, background = params[FLUX], params[BACKGROUND]
    height, width = signal.shape
    if params.size == 7:
        sheared_rows(params, rows)
        for y in range(height):
            for x in range(width):
                share, by_u, by_v = rows[1, y, x], rows[2, y, x], rows[3, y, x]
                signal[y, x] = flux * share
                mean_square[y, x] = flux * flux * (share * share + (by_u * by_u + by_v * by_v) / 12.0)
                residual[y, x] = data[y, x] - signal[y, x] - background
        return
    profile(params[U], params[LN_SU], along_u)
    profile(params[V], params[LN_SV], along_v)
    squares = np.empty(width)
    for x in range(width):
        squares[x] = along_u[0, x] * along_u[0, x] + along_u[1, x] * along_u[1, x] / 12.0
    for y in range(height):
        of_y = flux * along_v[0, y]
        square = flux * flux * (along_v[0, y] * along_v[0, y] + along_v[1, y] * along_v[1, y] / 12.0)
        for x in range(width):
            signal[y, x] = of_y * along_u[0, x]
            mean_square[y, x] = square * squares[x]
            residual[y, x] = data[y, x] - signal[y, x] - background


@compiled
def _solve(
    along_u: FloatArray,
    along_v: FloatArray,
    rows: FloatArray,
    weight: FloatArray,
    residual: FloatArray,
    cov: FloatArray,
    delta: FloatArray,
) -> None:
    """Fill the covariance (k, k) and the step (k,) of one window."""
    information, gradient = np.empty_like(cov), np.empty_like(delta)
    if delta.size == 7:
        dense_sums(rows, weight, residual, information, gradient)
    else:
        separable_sums(along_u, along_v, weight, residual, information, gradient)
    invert(information, cov)
    delta[:] = 0.0
    for a in range(delta.size):
        for b in range(delta.size):
            delta[a] += cov[a, b] * gradient[b]
    if not np.isfinite(delta.sum()):
        delta[:] = 0.0


@compiled
def _leverages(params: FloatArray, cov: FloatArray, data: FloatArray) -> FloatArray:
    """(n, height, width) leverage of every window's pixels."""
    leverage = np.empty_like(data)
    rows = np.empty((params.shape[1], data.shape[1], data.shape[2]))
    for i in range(len(params)):
        if params.shape[1] == 7:
            sheared_rows(params[i], rows)
        else:
            upright_rows(params[i], rows)
        fill_leverage(rows, cov[i], leverage[i])
    return leverage


@compiled
def _shear_score(along_u: FloatArray, along_v: FloatArray, weight: FloatArray, residual: FloatArray) -> float:
    """Squared score of the shear over its variance, for an upright fit."""
    score = information = 0.0
    for y in range(weight.shape[0]):
        for x in range(weight.shape[1]):
            by_shear = along_v[1, y] * along_u[1, x]
            score += by_shear * weight[y, x] * residual[y, x]
            information += by_shear * by_shear * weight[y, x]
    return score * score / max(information, 1e-300)


@compiled
def _fill_statistics(
    signal: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    by_speckle: FloatArray,
    flux_variance: float,
    out: FloatArray,
) -> None:
    """Fill a window's statistics (STATISTIC_COLUMNS,), except deviations of the position and SHEAR_SCORE.

    `by_speckle` is the share of speckle in the variance of each pixel.
    """
    height, width = signal.shape
    worst = at_rim = information = 0.0
    peak, in_rim = -math.inf, 0
    for y in range(height):
        for x in range(width):
            excess = residual[y, x] * residual[y, x] * weight[y, x]
            worst = max(worst, excess)
            peak = max(peak, signal[y, x])
            information += weight[y, x] / (1.0 - by_speckle[y, x]) * signal[y, x] * signal[y, x]
            if y == 0 or y == height - 1 or x == 0 or x == width - 1:
                at_rim += excess
                in_rim += weight[y, x] > 0.0
    out[WORST_EXCESS], out[PEAK_DN], out[INFORMATION] = worst, peak, information
    out[RIM_NOISE], out[RIM_PIXELS] = at_rim / max(in_rim, 1), in_rim
    out[FLUX_DEVIATION] = math.sqrt(max(flux_variance, 0.0))


@compiled
def _variance_by_noise(cov: FloatArray, information: FloatArray, parameter: int) -> float:
    """Part of a parameter's variance in the covariance `cov` (k, k) that is due to noise.

    Args:
        cov: Covariance by noise and speckle.
        information: (k, k) sums of the derivatives with the weights W N W, where N is the variance of noise.
        parameter: Index of the parameter.
    """
    variance = 0.0
    for a in range(len(cov)):
        for b in range(len(cov)):
            variance += cov[parameter, a] * information[a, b] * cov[parameter, b]
    total = max(cov[parameter, parameter], 0.0)
    bounded: float = min(max(variance, LEAST_NOISE_SHARE * total), total)  # against rounding
    return bounded


@compiled
def _fill_deviations(
    along_u: FloatArray,
    along_v: FloatArray,
    rows: FloatArray,
    weight: FloatArray,
    by_speckle: FloatArray,
    cov: FloatArray,
    params: FloatArray,
    contrast2: float,
    out: FloatArray,
) -> None:
    """Fill the deviations of position and flux among a window's statistics, by noise and by speckle.

    The covariance `cov` is the sum of both (sandwich formula, docs/spots.md). That of noise is
    `cov (J^T W N W J) cov` with the weights W and the variance N of noise alone, a share of 1 / W.
    """
    information, gradient = np.empty_like(cov), np.empty_like(params)
    noise = weight * (1.0 - by_speckle)
    if params.size == 7:
        dense_sums(rows, noise, by_speckle, information, gradient)
    else:
        separable_sums(along_u, along_v, noise, by_speckle, information, gradient)
    flux2, grains = max(params[FLUX], 1e-12) ** 2, shared_grains(contrast2)
    out[FLUX_NOISE] = math.sqrt(_variance_by_noise(cov, information, FLUX))
    for axis in range(2):
        variance = _variance_by_noise(cov, information, U + axis)
        speckle = grains * (max(cov[U + axis, U + axis], 0.0) - variance)
        out[U_DEVIATION + axis] = math.sqrt(variance / flux2)
        out[U_SPECKLE + axis] = math.sqrt(speckle / flux2)


@compiled
def fisher_scoring(
    data: FloatArray,
    usable: BoolArray,
    clip: FloatArray,
    floor: FloatArray,
    slope: FloatArray,
    contrast2: FloatArray,
    stated_contrast2: float,
    params: FloatArray,
    cov: FloatArray,
    signal: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    converged: BoolArray,
    statistics: FloatArray,
) -> None:
    """Fit one spot per window, starting at `params`; it and all arguments after it are filled, see `SpotFit`.

    `slope` and `contrast2` (n,) are replaced by the measured ones. The caller allocates all arrays, since
    returning a new one takes longer than a step of one window.
    """
    n, k = params.shape
    delta = np.empty((n, k))
    mean_square = np.empty_like(data)
    along_u, along_v = np.empty((n, 4, data.shape[2])), np.empty((n, 4, data.shape[1]))
    rows = np.empty((n, k, data.shape[1], data.shape[2]))
    measured = False
    for step in range(_MAX_STEPS):
        for i in range(n):
            _evaluate(
                params[i],
                data[i],
                along_u[i],
                along_v[i],
                rows[i],
                signal[i],
                mean_square[i],
                residual[i],
            )
        again = True
        while again:
            within = True
            for i in range(n):
                _fill_weights(
                    usable[i],
                    clip[i],
                    signal[i],
                    mean_square[i],
                    params[i, BACKGROUND],
                    floor[i],
                    slope[i],
                    contrast2[i],
                    weight[i],
                )
                _solve(along_u[i], along_v[i], rows[i], weight[i], residual[i], cov[i], delta[i])
                within = within and _within(delta[i], cov[i], 0.0)
            again = not measured and (within or step == _STEPS_TO_MEASURE)
            if again:
                leverage = _leverages(params, cov, data)
                measure_variance(
                    signal,
                    mean_square,
                    residual,
                    weight,
                    leverage,
                    floor,
                    slope,
                    contrast2,
                    stated_contrast2,
                )
                measured = True
        if step == _STEPS_TO_SETTLE:
            usable = weight > 0.0
            clip = np.full_like(clip, math.inf)
        for i in range(n):
            converged[i] = _within(delta[i], cov[i], max(_SMALL_STEP * abs(params[i, FLUX]), 1e-300))
            _apply_step(params[i], delta[i])
        if measured and converged.all():
            break
    for i in range(n):
        by_speckle = weight[i] * contrast2[i] * mean_square[i]
        _fill_statistics(signal[i], residual[i], weight[i], by_speckle, cov[i, FLUX, FLUX], statistics[i])
        _fill_deviations(
            along_u[i],
            along_v[i],
            rows[i],
            weight[i],
            by_speckle,
            cov[i],
            params[i],
            contrast2[i],
            statistics[i],
        )
        statistics[i, SHEAR_SCORE] = (
            0.0 if k == 7 else _shear_score(along_u[i], along_v[i], weight[i], residual[i])
        )
