"""Measurement of the spots at detected peaks: windows, fits, larger windows where a spot needs one."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.spot import NO_FLAGS, Failure, Spot
from workbench.spots.detect import FINE_PX, Peaks
from workbench.spots.fit import Windows
from workbench.spots.kernels.acceptance import COLUMNS, NEXT_HALF, U_SD, fit_group
from workbench.spots.kernels.columns import FLUX, LN_SU, U, V
from workbench.spots.kernels.windows import HALVES_PX, flag_codes, halves_for, moment_guess
from workbench.spots.pair import PairSignal

# Factor on guessed widths, which are biased upwards; a window that is too small is replaced by a larger one.
_GUESS_SCALE: Final = 0.7
_SMALLEST: Final = HALVES_PX[0]
_MAX_CUTS: Final = 3
# Full well for the first guess of the photon-transfer slope, which is then measured.
_FULL_WELL_ELECTRONS: Final = 1e4
# Flags by the codes of `flag_codes`.
_FLAGS: Final = (
    NO_FLAGS,
    frozenset({Failure.AT_EDGE}),
    frozenset({Failure.SATURATED}),
    frozenset({Failure.AT_EDGE, Failure.SATURATED}),
)


class FittedSpot(NamedTuple):
    """Measured spot, with the values that deblending needs."""

    spot: Spot
    params: FloatArray
    """(6,) or (7,) as in `kernels.columns`, u and v in pixels of the image."""
    slope_dn: float
    """Photon-transfer slope, as measured."""
    contrast2: float
    """Squared contrast of speckle, as measured."""
    reach_px: float
    """The larger of both widths."""
    flux_snr: float
    """Flux over its standard deviation by noise, without speckle, which is light."""
    scene: PairSignal
    """The strip that it was found in."""


def spot_flags(scene: PairSignal, params: FloatArray) -> list[frozenset[Failure]]:
    """Flags of n spots (n, 6 or more), in pixels of the image: at its border, clipped."""
    codes = np.empty(len(params), np.intp)
    flag_codes(scene.pair.on, scene.pair.clip_dn, params, codes)
    return [_FLAGS[code] for code in codes.tolist()]


def measure(scene: PairSignal, peaks: Peaks) -> list[FittedSpot]:
    """Fit every peak; return the accepted spots."""
    n = peaks.rows.size
    if n == 0:
        return []
    rows, cols, found = peaks.rows.copy(), peaks.cols.copy(), np.zeros((n, COLUMNS))
    win = scene.pair.cut(rows, cols, np.arange(n), _SMALLEST)
    start, scatter = first_guess(win, peaks)
    sizes = np.empty(n, np.intp)
    halves_for(start, scatter, sizes)
    halves = sizes.tolist()
    slope_dn, shape = scene.pair.clip_dn / _FULL_WELL_ELECTRONS, scene.pair.on.shape
    for turn in range(_MAX_CUTS):
        # Small windows first: a spot that outgrows its window joins the group of the next size.
        for half in HALVES_PX:
            if half not in halves:
                continue
            group = [k for k, own in enumerate(halves) if own == half]
            numbers = np.array(group)
            if turn > 0 or half > _SMALLEST or len(group) < n:
                win = scene.pair.cut(rows, cols, numbers, half)
            fit_group(
                *win,
                numbers,
                rows,
                cols,
                start,
                scene.variance,
                slope_dn,
                scene.pair.stated_contrast2,
                shape,
                found,
            )
            for k, wanted in zip(group, found[numbers, NEXT_HALF].tolist(), strict=True):
                halves[k] = int(wanted)
        if not any(halves):
            break
    return _fitted_spots(scene, found)


def first_guess(win: Windows, peaks: Peaks) -> tuple[FloatArray, float]:
    """First guesses (n, 6) in pixels of the image, and the factor on their widths for the size of the window.

    For sharp peaks from the moments of the window, for wide ones from the matched filter of the search.
    """
    start = np.zeros((peaks.rows.size, 6))
    if peaks.scale_px == FINE_PX:
        moment_guess(win.data, win.usable, peaks.rows, peaks.cols, start)
        return start, _GUESS_SCALE
    start[:, U], start[:, V] = peaks.cols, peaks.rows
    start[:, FLUX] = peaks.height_dn * (4.0 * np.pi * peaks.scale_px**2)
    start[:, LN_SU:] = np.log(peaks.scale_px)
    return start, 1.0


def _fitted_spots(scene: PairSignal, found: FloatArray) -> list[FittedSpot]:
    """Accepted spots of the table of fits."""
    flags = spot_flags(scene, found)
    fits = []
    for params, row, its_flags in zip(found, found.tolist(), flags, strict=True):
        _, flux, u, v, ln_su, ln_sv, _, u_sd, v_sd, u_speckle, v_speckle, *rest, is_spot, _ = row
        if is_spot:
            _, flux_noise_sd, peak, slope, contrast2 = rest
            width, reach = math.exp(0.5 * (ln_su + ln_sv)), math.exp(max(ln_su, ln_sv))
            spot = Spot(u, v, u_sd, v_sd, flux, width, peak, its_flags, None, u_speckle, v_speckle)
            fits.append(FittedSpot(spot, params[:U_SD], slope, contrast2, reach, flux / flux_noise_sd, scene))
    return fits
