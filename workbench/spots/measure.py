"""From peaks to measured spots: windows cut, fitted together, cut anew where a spot asks for another."""

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
from workbench.spots.kernels.windows import HALVES_PX, flag_codes, guess, halves_for
from workbench.spots.pair import PairSignal

# First guesses of the width scatter upwards; a window too small is cut anew.
_GUESSED: Final = 0.7
_SMALLEST: Final = HALVES_PX[0]
_MAX_CUTS: Final = 3
# Electrons that fill a pixel: only the first guess of the photon-transfer slope, which is then measured.
_FULL_WELL_ELECTRONS: Final = 1e4
# By the codes of `flag_codes`.
_FLAGS: Final = (
    NO_FLAGS,
    frozenset({Failure.AT_EDGE}),
    frozenset({Failure.SATURATED}),
    frozenset({Failure.AT_EDGE, Failure.SATURATED}),
)


class FittedSpot(NamedTuple):
    """A measured spot with what telling neighbours apart needs."""

    spot: Spot
    params: FloatArray
    """(6,) or (7,) as in `gaussian`, u and v in pixels of the image."""
    slope_dn: float
    reach_px: float
    """The larger of both widths."""
    clarity: float
    """Flux over its standard deviation."""
    scene: PairSignal
    """The strip that it was found in."""


def spot_flags(scene: PairSignal, params: FloatArray) -> list[frozenset[Failure]]:
    """What the places of n spots (n, 6 or more) in the image tell: cut by its border, clipped."""
    codes = np.empty(len(params), np.intp)
    flag_codes(scene.pair.on, scene.pair.clip_dn, params, codes)
    return [_FLAGS[code] for code in codes.tolist()]


def measure(scene: PairSignal, peaks: Peaks) -> list[FittedSpot]:
    """Fit every peak and keep those that are spots."""
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
        # Small windows first: a spot that outgrows its window is fitted again with those of its new size.
        for half in HALVES_PX:
            if half not in halves:
                continue
            group = [k for k, own in enumerate(halves) if own == half]
            numbers = np.array(group)
            if turn > 0 or half > _SMALLEST or len(group) < n:
                win = scene.pair.cut(rows, cols, numbers, half)
            fit_group(*win, numbers, rows, cols, start, scene.variance, slope_dn, shape, found)
            for k, wanted in zip(group, found[numbers, NEXT_HALF].tolist(), strict=True):
                halves[k] = int(wanted)
        if not any(halves):
            break
    return _traces(scene, found)


def first_guess(win: Windows, peaks: Peaks) -> tuple[FloatArray, float]:
    """Start (n, 6) in pixels of the image, and by how much its widths tend to be too large.

    From the shape of a sharp peak, from what the search was matched to for a wide one.
    """
    start = np.zeros((peaks.rows.size, 6))
    if peaks.scale_px == FINE_PX:
        guess(win.data, win.usable, peaks.rows, peaks.cols, start)
        return start, _GUESSED
    start[:, U], start[:, V] = peaks.cols, peaks.rows
    start[:, FLUX] = peaks.height_dn * (4.0 * np.pi * peaks.scale_px**2)
    start[:, LN_SU:] = np.log(peaks.scale_px)
    return start, 1.0


def _traces(scene: PairSignal, found: FloatArray) -> list[FittedSpot]:
    """What the table of fits says is a spot."""
    flags = spot_flags(scene, found)
    traces = []
    for params, row, its_flags in zip(found, found.tolist(), flags, strict=True):
        _, flux, u, v, ln_su, ln_sv, _, u_sd, v_sd, flux_sd, peak, slope, is_spot, _ = row
        if is_spot:
            spot = Spot(u, v, u_sd, v_sd, flux, math.exp(0.5 * (ln_su + ln_sv)), peak, its_flags)
            reach = math.exp(max(ln_su, ln_sv))
            traces.append(FittedSpot(spot, params[:U_SD], slope, reach, flux / flux_sd, scene))
    return traces
