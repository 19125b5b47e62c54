"""From windows to measured spots in one compiled call: fit, fit again where residuals ask for it, judge."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.spots.kernels.columns import (
    ACCEPTANCE_COLUMNS,
    FLUX,
    FLUX_DEVIATION,
    INFORMATION,
    LN_SU,
    LN_SV,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR,
    SHEAR_SCORE,
    U_DEVIATION,
    V_DEVIATION,
    WORST_EXCESS,
    U,
    V,
)
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.single import score
from workbench.spots.kernels.windows import half_for
from workbench.spots.noise import ROUNDING_DN2

# Columns of a table of spots, one row each. The first seven are the parameters as in `gaussian`, in pixels of
# the image; the next half-width is 0 for a spot whose window fits.
U_SD, V_SD, FLUX_SD, PEAK, SLOPE, IS_SPOT, NEXT_HALF = range(7, 14)
COLUMNS: Final = 14
# Narrower than any lens makes a spot: a hot pixel. (A pixel integrates; 0 is possible, 0.6 the least
# specified.)
_MIN_WIDTH_PX: Final = 0.5
_MAX_WIDTH_PX: Final = 7.0
_MIN_FLUX_SD: Final = 6.0
_MIN_TOLD_SD: Final = 3.0
# A window is cut anew only for a spot that outgrows it by this factor: the loss up to there is below 1 %.
_OUTGROWN: Final = 0.9
# Its width counts with 2 sd on top: where noise made a faint spot look narrow, the window must not follow.
# (The logarithm of a width is as uncertain as the flux relative to itself.)
_WIDTH_SD: Final = 2.0
# The inverse Fisher matrix is the first term of a series in 1 / told: this is the next one's factor for a
# position, and for the scatter of its stated variance (docs/spots.md).
_SECOND_ORDER: Final = 13.0
_OFF_CENTRE_PX: Final = 1.5
_OUTLIER_SD: Final = 6.0
_MAX_OUTLIERS: Final = 3
_SHEAR_SD: Final = 5.0
_RIM_SD: Final = 5.0


@compiled
def without_outliers(
    usable: BoolArray, signal: FloatArray, residual: FloatArray, weight: FloatArray, judged: FloatArray
) -> tuple[BoolArray, bool]:
    """Usable pixels of n windows without the few that no spot explains, and whether there are any.

    These are hot pixels. The arguments are as in `Windows` and `Fit`.
    """
    kept, changed = usable, False
    for i in range(len(usable)):
        if judged[i, WORST_EXCESS] <= _OUTLIER_SD**2:
            continue
        far = residual[i] * residual[i] * weight[i] > _OUTLIER_SD**2
        if far.sum() <= _MAX_OUTLIERS:
            far &= np.abs(residual[i]) > 0.1 * signal[i].max()
            if far.any():
                kept = kept if changed else usable.copy()
                kept[i] &= ~far
                changed = True
    return kept, changed


@compiled
def _follow_rim(floor: FloatArray, judged: FloatArray) -> bool:
    """Take the floor (n,) of windows from their rim where it is not as noisy as predicted; whether any is.

    Clutter and bright surroundings make it noisier, a dark patch of a bright scene quieter. The threshold is
    5 sd of the estimate from those of the rim's pixels that are used, so that an even scene keeps the strip's
    floor, which is known better.
    """
    changed = False
    for i in range(len(floor)):
        n = max(judged[i, RIM_PIXELS], 1.0)
        # The mean of n squares is far from Gaussian below 1: its cube root is not (Wilson and Hilferty).
        least = max(1.0 - 2.0 / (9.0 * n) - _RIM_SD * math.sqrt(2.0 / (9.0 * n)), 0.0) ** 3
        if judged[i, RIM_NOISE] > 1.0 + _RIM_SD * math.sqrt(2.0 / n) or 0.0 < judged[i, RIM_NOISE] < least:
            floor[i] = max(floor[i] * judged[i, RIM_NOISE], ROUNDING_DN2)
            changed = True
    return changed


@compiled
def _is_spot(params: FloatArray, judged: FloatArray, shape: tuple[int, int]) -> bool:
    """Whether a fit that converged is a spot in the image; see `Fit` for `judged`."""
    mean_width = math.exp(0.5 * (params[LN_SU] + params[LN_SV]))
    return (
        params[FLUX] > 0.0
        # Were place and shape known: whether anything is there is not a question of its width.
        and judged[INFORMATION] > _MIN_FLUX_SD**2 * max(judged[RIM_NOISE], 1.0)
        # ... but a swelling of the background is not one: there flux and background cannot be told apart.
        and params[FLUX] > _MIN_TOLD_SD * judged[FLUX_DEVIATION]
        and _MIN_WIDTH_PX <= mean_width <= _MAX_WIDTH_PX
        and -0.5 <= params[U] <= shape[1] - 0.5
        and -0.5 <= params[V] <= shape[0] - 0.5
    )


@compiled
def _fit_tilted(
    data: FloatArray,
    usable: BoolArray,
    clip: FloatArray,
    floor: FloatArray,
    guess: FloatArray,
    start: FloatArray,
    tilted: FloatArray,
) -> tuple[bool, FloatArray, float]:
    """Fit one window by an ellipse at any angle: whether that converged, `Fit.judged`, slope.

    `start` (6,) is that of an upright one, `tilted` (1, 7) is filled.
    """
    tilted[0, :6], tilted[0, SHEAR] = start, 0.0
    cov, judged, slope = np.empty((1, 7, 7)), np.empty((1, ACCEPTANCE_COLUMNS)), np.empty(1)
    signal, residual, weight = np.empty_like(data), np.empty_like(data), np.empty_like(data)
    converged = np.empty(1, np.bool_)
    score(data, usable, clip, floor, guess, tilted, cov, signal, residual, weight, converged, slope, judged)
    return converged[0], judged[0], slope[0]


@compiled
def _note(params: FloatArray, judged: FloatArray, slope: float, row: FloatArray) -> None:
    """Fill a spot's row of the table, all but the next window."""
    row[SHEAR] = 0.0
    row[: params.size] = params
    curved = math.sqrt(1.0 + _SECOND_ORDER / judged[INFORMATION])
    row[U_SD], row[V_SD], row[FLUX_SD] = (
        judged[U_DEVIATION] * curved,
        judged[V_DEVIATION] * curved,
        judged[FLUX_DEVIATION],
    )
    row[PEAK], row[SLOPE], row[IS_SPOT] = judged[PEAK_DN], slope, 1.0


@compiled
def _ask_for_another_window(
    params: FloatArray, half: int, rows: FloatArray, cols: FloatArray, k: int, found: FloatArray
) -> None:
    """Note that spot k needs another window, and where, if it outgrows its own or lies off its middle."""
    margin = _WIDTH_SD * found[k, FLUX_SD] / params[FLUX]
    wanted = half_for(_OUTGROWN * math.exp(max(params[LN_SU], params[LN_SV]) + margin))
    if wanted > half or max(abs(params[U] - cols[k]), abs(params[V] - rows[k])) > _OFF_CENTRE_PX:
        found[k, NEXT_HALF] = max(wanted, half)
        rows[k], cols[k] = np.rint(params[V]), np.rint(params[U])


@compiled
def fit_group(
    data: FloatArray,
    usable: BoolArray,
    clip: FloatArray,
    group: IndexArray,
    rows: FloatArray,
    cols: FloatArray,
    start: FloatArray,
    variance: float,
    slope_dn: float,
    shape: tuple[int, int],
    found: FloatArray,
) -> None:
    """Fit windows of one size that belong to the peaks `group` of all; fill the rows of those that are spots.

    Args:
        data: (n, side, side) DN, one window each.
        usable: (n, side, side).
        clip: (n, side, side) as in `Windows`.
        group: (n,) numbers of the peaks.
        rows: (peaks,) middles of the windows; where a window should be cut anew, moved to the spot.
        cols: (peaks,).
        start: (peaks, 6) first guesses in pixels of the image; the fits of upright ellipses afterwards.
        variance: Of a pixel without signal, DN^2.
        slope_dn: First guess of the photon-transfer slope.
        shape: Height and width of the image.
        found: (peaks, COLUMNS) table of spots.
    """
    n, half = len(data), data.shape[1] // 2
    origin, params, tilted = np.zeros((n, 7)), np.empty((n, 6)), np.empty((1, 7))
    for i in range(n):
        origin[i, U], origin[i, V] = cols[group[i]] - half, rows[group[i]] - half
        params[i] = start[group[i]] - origin[i, :6]
    cov, judged, slope = np.empty((n, 6, 6)), np.empty((n, ACCEPTANCE_COLUMNS)), np.empty(n)
    signal, residual, weight = np.empty_like(data), np.empty_like(data), np.empty_like(data)
    floor, guess, converged = np.full(n, variance), np.full(n, slope_dn), np.empty(n, np.bool_)
    asked = True
    for turn in range(3):
        if asked:
            score(
                data,
                usable,
                clip,
                floor,
                guess,
                params,
                cov,
                signal,
                residual,
                weight,
                converged,
                slope,
                judged,
            )
        if turn == 0:
            usable, asked = without_outliers(usable, signal, residual, weight, judged)
        elif turn == 1:
            asked = _follow_rim(floor, judged)
    for i in range(n):
        k = group[i]
        start[k] = params[i] + origin[i, :6]
        found[k, NEXT_HALF] = 0.0
        final, its_judged, its_slope, is_there = start[k], judged[i], slope[i], converged[i]
        if judged[i, SHEAR_SCORE] > _SHEAR_SD**2:
            fitted, tilted_judged, tilted_slope = _fit_tilted(
                data[i : i + 1],
                usable[i : i + 1],
                clip[i : i + 1],
                floor[i : i + 1],
                guess[i : i + 1],
                params[i],
                tilted,
            )
            if fitted:
                final, its_judged, its_slope, is_there = (
                    tilted[0] + origin[i],
                    tilted_judged,
                    tilted_slope,
                    True,
                )
        if is_there and _is_spot(final, its_judged, shape):
            _note(final, its_judged, its_slope, found[k])
            _ask_for_another_window(start[k], half, rows, cols, k, found)
