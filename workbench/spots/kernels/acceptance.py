"""Fit windows, refit without outliers and with the rim's noise, and accept those that hold a spot (compiled).

A fit is a spot if `A = sum w m^2 > 36 max(q, 1)` and `F > 3 sd(F)`. Here w are the weights, m is the fitted
signal, F its flux, q the noise of the rim over the predicted noise. The signal-to-noise ratio of a matched
filter (position, widths and background known) is sqrt(A). White noise exceeds 6 at one position in 1e9, and
a frame has some 1e6 independent ones. The second condition, with sd(F) from the full covariance, excludes a
swelling of the background: its A is large, but its flux and background are not determined separately.
Squared residuals, and the squared score of a shear, are chi-squared over their variances, with one degree of
freedom. Above 36 (2e-9) a pixel is an outlier; above 25 (6e-7) a tilted ellipse is fitted.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.spots.kernels.columns import (
    FLUX,
    FLUX_DEVIATION,
    FLUX_NOISE,
    INFORMATION,
    LN_SU,
    LN_SV,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR,
    SHEAR_SCORE,
    STATISTIC_COLUMNS,
    U_DEVIATION,
    U_SPECKLE,
    V_DEVIATION,
    V_SPECKLE,
    WORST_EXCESS,
    U,
    V,
)
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.single import fisher_scoring
from workbench.spots.kernels.windows import half_for
from workbench.spots.noise import ROUNDING_DN2

# Columns of a table of spots, one row each. The first seven are the parameters as in `columns`, in pixels of
# the image; the next half-width is 0 where the window suits the spot.
(
    U_SD,
    V_SD,
    U_SPECKLE_SD,
    V_SPECKLE_SD,
    FLUX_SD,
    FLUX_NOISE_SD,
    PEAK,
    SLOPE,
    CONTRAST2,
    IS_SPOT,
    NEXT_HALF,
) = range(7, 18)
COLUMNS: Final = 18
# Below the narrowest spot of a lens (0.6 px is the least specified): a hot pixel.
_MIN_WIDTH_PX: Final = 0.5
_MAX_WIDTH_PX: Final = 7.0
# Flux over its standard deviation: other parameters known, and all parameters free. Derivation above.
_MIN_MATCHED_SNR: Final = 6.0
_MIN_FLUX_SNR: Final = 3.0
# A larger window is cut where the width times this factor needs one; the loss up to there is below 1 %.
_OUTGROWN: Final = 0.9
# Standard deviations added to the width for this test, so that noise that makes a faint spot look narrow
# does not keep its window small. (sd of ln width = relative sd of the flux.)
_WIDTH_SD: Final = 2.0
# The inverse Fisher matrix is the first term of a series in 1 / A: factor of the next term for a position,
# with the scatter of its stated variance (docs/spots.md).
_SECOND_ORDER: Final = 13.0
_OFF_CENTRE_PX: Final = 1.5
_OUTLIER_SD: Final = 6.0
_MAX_OUTLIERS: Final = 3
_SHEAR_SD: Final = 5.0
_RIM_SD: Final = 5.0


@compiled
def without_outliers(
    usable: BoolArray, signal: FloatArray, residual: FloatArray, weight: FloatArray, statistics: FloatArray
) -> tuple[BoolArray, bool]:
    """Usable pixels of n windows without outliers (hot pixels), and whether there are any.

    A window with more than three outliers keeps them: they are no hot pixels, but a misfit. The arguments
    are as in `Windows` and `SpotFit`.
    """
    kept, changed = usable, False
    for i in range(len(usable)):
        if statistics[i, WORST_EXCESS] <= _OUTLIER_SD**2:
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
def _take_floor_from_rim(floor: FloatArray, statistics: FloatArray) -> bool:
    """Scale the floor (n,) of windows whose rim is significantly more or less noisy than predicted.

    Clutter and bright surroundings raise the noise, a dark patch of a bright scene lowers it. The threshold
    is 5 sd of the mean squared residual, sqrt(2 / n) for n used pixels. An even scene therefore keeps the
    floor of the strip, which is more certain.

    Returns:
        Whether any floor changed.
    """
    changed = False
    for i in range(len(floor)):
        n = max(statistics[i, RIM_PIXELS], 1.0)
        # The lower tail of chi-squared is far from Gaussian; that of its cube root is not (Wilson, Hilferty).
        least = max(1.0 - 2.0 / (9.0 * n) - _RIM_SD * math.sqrt(2.0 / (9.0 * n)), 0.0) ** 3
        if (
            statistics[i, RIM_NOISE] > 1.0 + _RIM_SD * math.sqrt(2.0 / n)
            or 0.0 < statistics[i, RIM_NOISE] < least
        ):
            floor[i] = max(floor[i] * statistics[i, RIM_NOISE], ROUNDING_DN2)
            changed = True
    return changed


@compiled
def _is_spot(params: FloatArray, statistics: FloatArray, shape: tuple[int, int]) -> bool:
    """Whether a converged fit is a spot inside the image; `statistics` as in `columns`."""
    mean_width = math.exp(0.5 * (params[LN_SU] + params[LN_SV]))
    return (
        params[FLUX] > 0.0
        # Detection does not depend on how well the width is determined.
        and statistics[INFORMATION] > _MIN_MATCHED_SNR**2 * max(statistics[RIM_NOISE], 1.0)
        # Excludes a swelling of the background, whose flux and background are correlated. Speckle is light: a
        # clipped spot, whose flux is that of its rim alone, is not missed for it.
        and params[FLUX] > _MIN_FLUX_SNR * statistics[FLUX_NOISE]
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
    slope: FloatArray,
    contrast2: FloatArray,
    stated_contrast2: float,
    start: FloatArray,
    tilted: FloatArray,
) -> tuple[bool, FloatArray]:
    """Fit an ellipse at any angle to one window, from the upright fit `start` (6,); fill `tilted` (1, 7).

    `slope` and `contrast2` (1,) are replaced by the measured ones.

    Returns:
        Whether it converged, the statistics (STATISTIC_COLUMNS,).
    """
    tilted[0, :6], tilted[0, SHEAR] = start, 0.0
    cov, statistics = np.empty((1, 7, 7)), np.empty((1, STATISTIC_COLUMNS))
    signal, residual, weight = np.empty_like(data), np.empty_like(data), np.empty_like(data)
    converged = np.empty(1, np.bool_)
    fisher_scoring(
        data,
        usable,
        clip,
        floor,
        slope,
        contrast2,
        stated_contrast2,
        tilted,
        cov,
        signal,
        residual,
        weight,
        converged,
        statistics,
    )
    return converged[0], statistics[0]


@compiled
def _fill_row(
    params: FloatArray, statistics: FloatArray, slope: float, contrast2: float, row: FloatArray
) -> None:
    """Fill a spot's row of the table, except `NEXT_HALF`."""
    row[SHEAR] = 0.0
    row[: params.size] = params
    inflation = math.sqrt(1.0 + _SECOND_ORDER / statistics[INFORMATION])
    row[U_SD], row[V_SD] = statistics[U_DEVIATION] * inflation, statistics[V_DEVIATION] * inflation
    row[U_SPECKLE_SD], row[V_SPECKLE_SD] = (
        statistics[U_SPECKLE] * inflation,
        statistics[V_SPECKLE] * inflation,
    )
    row[FLUX_SD] = statistics[FLUX_DEVIATION] * inflation
    row[FLUX_NOISE_SD] = statistics[FLUX_NOISE] * inflation
    row[PEAK], row[SLOPE], row[CONTRAST2], row[IS_SPOT] = statistics[PEAK_DN], slope, contrast2, 1.0


@compiled
def _request_window(
    params: FloatArray, half: int, rows: FloatArray, cols: FloatArray, k: int, found: FloatArray
) -> None:
    """Fill size and centre of the next window of spot k, if it outgrows its own or is off its centre."""
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
    stated_contrast2: float,
    shape: tuple[int, int],
    found: FloatArray,
) -> None:
    """Fit windows of one size around the peaks `group`; fill the rows of those that are spots.

    Args:
        data: (n, side, side) DN, one window each.
        usable: (n, side, side).
        clip: (n, side, side) as in `Windows`.
        group: (n,) indices of the peaks.
        rows: (peaks,) rows of the window centres; moved to the spot where another window is needed.
        cols: (peaks,) columns, likewise.
        start: (peaks, 6) first guesses in pixels of the image; replaced by the fits of upright ellipses.
        variance: Of a pixel without signal, DN^2.
        slope_dn: First guess of the photon-transfer slope.
        stated_contrast2: Squared contrast of speckle; 0: not known.
        shape: Height and width of the image.
        found: (peaks, COLUMNS) table of spots.
    """
    n, half = len(data), data.shape[1] // 2
    origin, params, tilted = np.zeros((n, 7)), np.empty((n, 6)), np.empty((1, 7))
    for i in range(n):
        origin[i, U], origin[i, V] = cols[group[i]] - half, rows[group[i]] - half
        params[i] = start[group[i]] - origin[i, :6]
    cov, statistics = np.empty((n, 6, 6)), np.empty((n, STATISTIC_COLUMNS))
    signal, residual, weight = np.empty_like(data), np.empty_like(data), np.empty_like(data)
    floor, converged = np.full(n, variance), np.empty(n, np.bool_)
    slope, contrast2 = np.empty(n), np.empty(n)
    refit = True
    for turn in range(3):
        if refit:
            slope[:], contrast2[:] = slope_dn, stated_contrast2
            fisher_scoring(
                data,
                usable,
                clip,
                floor,
                slope,
                contrast2,
                stated_contrast2,
                params,
                cov,
                signal,
                residual,
                weight,
                converged,
                statistics,
            )
        if turn == 0:
            usable, refit = without_outliers(usable, signal, residual, weight, statistics)
        elif turn == 1:
            refit = _take_floor_from_rim(floor, statistics)
    for i in range(n):
        k, one = group[i], slice(i, i + 1)
        start[k] = params[i] + origin[i, :6]
        found[k, NEXT_HALF] = 0.0
        final, final_statistics, is_fitted = start[k], statistics[i], converged[i]
        if statistics[i, SHEAR_SCORE] > _SHEAR_SD**2:
            own_slope, own_contrast2 = np.full(1, slope_dn), np.full(1, stated_contrast2)
            fitted, tilted_statistics = _fit_tilted(
                data[one],
                usable[one],
                clip[one],
                floor[one],
                own_slope,
                own_contrast2,
                stated_contrast2,
                params[i],
                tilted,
            )
            if fitted:
                final, final_statistics, is_fitted = tilted[0] + origin[i], tilted_statistics, True
                slope[i], contrast2[i] = own_slope[0], own_contrast2[0]
        if is_fitted and _is_spot(final, final_statistics, shape):
            _fill_row(final, final_statistics, slope[i], contrast2[i], found[k])
            _request_window(start[k], half, rows, cols, k, found)
