"""Joint fit of a window with its deviations and the noise of its light, compiled as one call."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.columns import LN_SU
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.joint import joint_fisher_scoring
from workbench.spots.kernels.joint_sums import OWN, SHARED
from workbench.spots.kernels.photon_transfer import measure_variance, shared_grains
from workbench.spots.kernels.single import LEAST_NOISE_SHARE

# As in `acceptance`; smaller, because all spots together determine the widths (docs/spots.md).
_SECOND_ORDER: Final = 10.0


@compiled
def _second_order(variance_px2: float, width_px: float) -> float:
    """Factor on the standard deviations of a coordinate by the second term of their series in 1 / A.

    A is the information on the amplitude as in `acceptance`. It is taken from the variance of the coordinate,
    which is 2 width^2 / A for an isolated spot in white noise; an overlapping neighbour lowers it.
    """
    return math.sqrt(1.0 + 0.5 * _SECOND_ORDER * variance_px2 / (width_px * width_px))


@compiled
def _fill_deviations(
    params: FloatArray,
    cov: FloatArray,
    by_noise: FloatArray,
    contrast2: float,
    sd: FloatArray,
    speckle_sd: FloatArray,
) -> None:
    """Fill the deviations of flux, u and v (k, 3), the position's by noise, and those by speckle (k, 2)."""
    grains = shared_grains(contrast2)
    for i in range(len(params)):
        own = SHARED + OWN * i
        sd[i, 0] = math.sqrt(max(cov[own, own], 0.0))
        for axis in range(2):
            total = max(cov[own + 1 + axis, own + 1 + axis], 0.0)
            noise = min(max(by_noise[i, axis], LEAST_NOISE_SHARE * total), total)  # against rounding
            widened = _second_order(total, math.exp(params[i, LN_SU + axis]))
            sd[i, 1 + axis] = math.sqrt(noise) * widened
            speckle_sd[i, axis] = math.sqrt((total - noise) * grains) * widened


@compiled
def fit_window(
    data: FloatArray,
    usable: BoolArray,
    noise: tuple[float, float, float],
    assumed: tuple[float, float],
    stated_contrast2: float,
    fixed: bool,
    params: FloatArray,
    weight: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float, float, float, bool]:
    """Fit k spots to a window (height, width), starting at `params`; see `joint_fit.fit_joint`.

    Args:
        data: (height, width), DN.
        usable: (height, width).
        noise: Variance without signal, photon-transfer slope, squared contrast of speckle.
        assumed: Slope and squared contrast that the measured ones are averaged with.
        stated_contrast2: Squared contrast as stated; 0: not known.
        fixed: Whether `weight` is given; it is filled otherwise.
        params: (k, 6) replaced by the fit.
        weight: (height, width) inverse variance, 0 where unused.

    Returns:
        (k, 3) deviations of flux, u, v, and (k, 2) of the position by speckle. (height, width) signal and
        residual. Sum of the weighted squares of these; slope and squared contrast, measured from them unless
        the weights are fixed. Whether the fit converged.
    """
    k, shape = len(params), data.shape
    m = SHARED + OWN * k
    cov, by_noise = np.empty((m, m)), np.zeros((k, 2))
    signal, mean_square, residual, leverage = (
        np.empty(shape),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape),
    )
    floor, slope, contrast2 = noise
    converged = joint_fisher_scoring(
        data,
        usable,
        floor,
        slope,
        contrast2,
        fixed,
        params,
        cov,
        by_noise,
        signal,
        mean_square,
        residual,
        weight,
        leverage,
    )
    if fixed:
        by_noise[:] = math.inf  # all of the variance
    sd, speckle_sd = np.empty((k, 3)), np.empty((k, 2))
    _fill_deviations(params, cov, by_noise, contrast2, sd, speckle_sd)
    chi2 = 0.0
    for y in range(shape[0]):
        for x in range(shape[1]):
            chi2 += weight[y, x] * residual[y, x] * residual[y, x]
    if not fixed:
        one = (1, shape[0], shape[1])
        slopes, contrasts = np.full(1, assumed[0]), np.full(1, assumed[1])
        measure_variance(
            signal.reshape(one),
            mean_square.reshape(one),
            residual.reshape(one),
            weight.reshape(one),
            leverage.reshape(one),
            np.full(1, floor),
            slopes,
            contrasts,
            stated_contrast2,
        )
        slope, contrast2 = slopes[0], contrasts[0]
    return sd, speckle_sd, signal, residual, chi2, slope, contrast2, converged
