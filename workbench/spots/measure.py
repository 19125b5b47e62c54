"""From peaks to measured spots: cut windows, fit them together, keep what is a spot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from workbench.spots.detect import FINE_PX, Peaks
from workbench.spots.fit import Fit, Windows, fit_spots
from workbench.spots.gaussian import FLUX, LN_SU, SHEAR, U, V
from workbench.spots.noise import Noise
from workbench.spots.pair import Scene
from workbench.spots.types import NO_FLAGS, Failure, Floats, Spot

Ints = NDArray[np.intp]
# Half-widths of windows; each holds spots whose width is up to (half - 0.5) / 3: what lies beyond 3 widths
# tells next to nothing about the position.
_HALVES_PX: Final = (5, 8, 13, 19)
_REACH_WIDTHS: Final = 3.0
# Narrower than any lens makes a spot: a hot pixel. (A pixel integrates; 0 is possible, 0.6 the least
# specified.)
_MIN_WIDTH_PX: Final = 0.5
_MAX_WIDTH_PX: Final = 7.0
_MIN_FLUX_SD: Final = 6.0
_MIN_TOLD_SD: Final = 3.0
_EDGE_WIDTHS: Final = 2.5
# A window is cut anew only for a spot that outgrows it by this factor: the loss up to there is below 1 %.
_OUTGROWN: Final = 0.9
# First guesses of the width scatter upwards; a window too small is cut anew.
_GUESSED: Final = 0.7
_OFF_CENTRE_PX: Final = 1.5
_OUTLIER_SD: Final = 6.0
_MAX_OUTLIERS: Final = 3
_SHEAR_SD: Final = 5.0
# Electrons that fill a pixel: only the first guess of the photon-transfer slope, which is then measured.
_FULL_WELL_ELECTRONS: Final = 1e4
# Columns of `Fit.judged`.
_WORST, _RIM, _TILT = 0, 1, 7


@dataclass(frozen=True, slots=True)
class Trace:
    """A measured spot with what telling neighbours apart needs."""

    spot: Spot
    params: Floats
    """(6,) or (7,) as in `gaussian`, u and v in pixels of the image."""
    slope_dn: float

    @property
    def reach_px(self) -> float:
        """The larger of both widths."""
        return math.exp(max(self.params[LN_SU:SHEAR].tolist()))


def half_for(width_px: float) -> int:
    """Half-width of the window for a spot."""
    for half in _HALVES_PX:
        if half >= _REACH_WIDTHS * width_px + 0.5:
            return half
    return _HALVES_PX[-1]


def first_guess(win: Windows, peaks: Peaks) -> Floats:
    """(n, 6) start: from the shape of a sharp peak, from what the search was matched to for a wide one."""
    from workbench.spots.pixels import guess  # loads the compiler, which only a fit needs

    if peaks.scale_px <= FINE_PX:
        return guess(win.data, win.usable)
    start = np.zeros((len(win.data), 6))
    start[:, U:LN_SU] = win.shape[0] // 2
    start[:, FLUX] = peaks.height_dn * (4.0 * np.pi * peaks.scale_px**2)
    start[:, LN_SU:] = np.log(peaks.scale_px)
    return start


def without_outliers(win: Windows, fit: Fit) -> Windows | None:
    """The windows without a few pixels that no spot explains (hot pixels); None if there are none."""
    if max(fit.judged[:, _WORST].tolist()) <= _OUTLIER_SD**2:
        return None
    excess = fit.residual * fit.residual * fit.weight
    far = excess > _OUTLIER_SD**2
    few = far & (far.sum(axis=(1, 2), keepdims=True) <= _MAX_OUTLIERS)
    few &= np.abs(fit.residual) > 0.1 * fit.signal.max(axis=(1, 2), keepdims=True)
    if not few.any():
        return None
    return Windows(win.data, win.usable & ~few, win.clip_dn)


def _local_floor(fit: Fit, floor: Floats) -> Floats | None:
    """(n,) floor of each window, raised where its rim is noisier than predicted; None if nowhere.

    Clutter and bright surroundings do that. The threshold is 5 sd of the estimate, so that an even scene
    keeps the strip's floor, which is known better.
    """
    limit = 1.0 + 5.0 * (2.0 / (4 * (fit.residual.shape[1] - 1))) ** 0.5
    if max(fit.judged[:, _RIM].tolist()) <= limit:
        return None
    ratio = fit.judged[:, _RIM]
    raised: Floats = floor * np.where(ratio > limit, ratio, 1.0)
    return raised


def _refined(win: Windows, fit: Fit, noise: Noise) -> tuple[Windows, Fit, Floats]:
    """The fit again where its residuals ask for it: hot pixels, a noisier rim; with its floor (n,)."""
    cleaned = without_outliers(win, fit)
    if cleaned is not None:
        win = cleaned
        fit = fit_spots(win, fit.params, noise)
    floor = _local_floor(fit, noise.floor_dn2)
    if floor is None:
        return win, fit, noise.floor_dn2
    return win, fit_spots(win, fit.params, Noise(floor, noise.slope_dn)), floor


def _fit_tilted(win: Windows, fit: Fit, i: int, noise: Noise) -> Fit | None:
    """Fit of spot `i` as an ellipse at any angle; None if that does not converge."""
    one = slice(i, i + 1)
    start = np.append(fit.params[one], [[0.0]], axis=1)
    again = fit_spots(win.only(one), start, Noise(noise.floor_dn2[one], noise.slope_dn[one]))
    return again if again.converged[0] else None


def spot_flags(scene: Scene, params: Floats) -> list[frozenset[Failure]]:
    """What can be told about n spots (n, 6) from their places in the image: cut by the border, clipped."""
    from workbench.spots.pixels import is_clipped  # loads the compiler, which only a fit needs

    height, width = scene.pair.on.shape
    flags = []
    clipped = is_clipped(scene.pair.on, scene.pair.clip_dn, params).tolist()
    for (_, _, u, v, ln_su, ln_sv, *_), is_bright in zip(params.tolist(), clipped, strict=True):
        at_edge = min(u, width - 1 - u) < _EDGE_WIDTHS * math.exp(ln_su) or min(
            v, height - 1 - v
        ) < _EDGE_WIDTHS * math.exp(ln_sv)
        told = ((Failure.AT_EDGE, at_edge), (Failure.SATURATED, is_bright))
        flags.append(frozenset(f for f, is_so in told if is_so) if at_edge or is_bright else NO_FLAGS)
    return flags


def _traces(scene: Scene, fit: Fit, params: Floats) -> list[Trace | None]:
    """What a fit found; None where it is no spot. `params` count from the image's first pixel."""
    slopes, converged = fit.slope_dn.tolist(), fit.converged.tolist()
    height, width = scene.pair.on.shape
    flags = spot_flags(scene, params)
    found: list[Trace | None] = []
    rows = zip(params.tolist(), fit.judged.tolist(), strict=True)
    for i, ((_, flux, u, v, ln_su, ln_sv, *_), (_, rim, peak, told, flux_sd, u_sd, v_sd, _)) in enumerate(
        rows
    ):
        mean_width = math.exp(0.5 * (ln_su + ln_sv))
        is_spot = (
            converged[i]
            and flux > 0
            # Were place and shape known: whether anything is there is not a question of its width.
            and told > _MIN_FLUX_SD**2 * max(rim, 1.0)
            # ... but a swelling of the background is not one: there flux and background cannot be told apart.
            and flux > _MIN_TOLD_SD * flux_sd
            and _MIN_WIDTH_PX <= mean_width <= _MAX_WIDTH_PX
            and -0.5 <= u <= width - 0.5
            and -0.5 <= v <= height - 0.5
        )
        spot = Spot(u, v, u_sd, v_sd, flux, mean_width, peak, flags[i]) if is_spot else None
        found.append(None if spot is None else Trace(spot, params[i], slopes[i]))
    return found


def _cut(scene: Scene, rows: Ints, cols: Ints, group: list[int], half: int) -> Windows:
    """The windows of some peaks without the pixels that lie nearer to another peak."""
    from workbench.spots.pixels import part  # loads the compiler, which only a fit needs

    win = scene.pair.cut(rows[group], cols[group], half)
    part(win.usable, rows, cols, np.array(group))
    return win


def _fit_group(
    scene: Scene, win: Windows, start: Floats, origin: Floats
) -> tuple[Floats, list[Trace | None]]:
    """Fit spots that share a size of window; all parameters count from the image's first pixel."""
    n = len(start)
    noise = Noise(np.full(n, scene.variance), np.full(n, scene.pair.clip_dn / _FULL_WELL_ELECTRONS))
    win, fit, floor = _refined(win, fit_spots(win, start - origin, noise), noise)
    params = fit.params + origin
    traces = _traces(scene, fit, params)
    for i, tilt in enumerate(fit.judged[:, _TILT].tolist()):
        if tilt <= _SHEAR_SD**2:
            continue
        again = _fit_tilted(win, fit, i, Noise(floor, noise.slope_dn))
        if again is not None:
            traces[i] = _traces(scene, again, again.params + np.append(origin[i], 0.0))[0]
    return params, traces


def _origin(rows: Ints, cols: Ints, half: int) -> Floats:
    """(n, 6) first pixel of each window, to be added to parameters."""
    origin = np.zeros((len(rows), 6))
    origin[:, U] = cols - half
    origin[:, V] = rows - half
    return origin


def measure(scene: Scene, peaks: Peaks) -> list[Trace]:
    """Fit every peak and keep those that are spots."""
    rows, cols = peaks.rows.copy(), peaks.cols.copy()
    if rows.size == 0:
        return []
    todo, least = list(range(rows.size)), _HALVES_PX[0]
    smallest = _cut(scene, rows, cols, todo, least)
    start = first_guess(smallest, peaks) + _origin(rows, cols, least)
    scatter = _GUESSED if peaks.scale_px == FINE_PX else 1.0
    sizes = [half_for(scatter * math.exp(w)) for w in start[:, LN_SU].tolist()]
    found: list[Trace | None] = [None] * rows.size
    for turn in range(3):
        again = []
        for half in sorted({sizes[k] for k in todo}):
            group = [k for k in todo if sizes[k] == half]
            is_cut = turn == 0 and half == least and len(group) == rows.size
            win = smallest if is_cut else _cut(scene, rows, cols, group, half)
            params, traces = _fit_group(scene, win, start[group], _origin(rows[group], cols[group], half))
            middles = zip(rows[group].tolist(), cols[group].tolist(), strict=True)
            for k, trace, one, (row, col) in zip(group, traces, params.tolist(), middles, strict=True):
                found[k] = trace or found[k]
                _, _, u, v, ln_su, ln_sv = one
                wanted = half_for(_OUTGROWN * math.exp(max(ln_su, ln_sv)))
                moved = max(abs(u - col), abs(v - row)) > _OFF_CENTRE_PX
                if trace is not None and (wanted > half or moved):
                    again.append(k)
                    start[k] = one
                    rows[k], cols[k] = round(v), round(u)
                    sizes[k] = max(wanted, half)
        todo = sorted(again)
        if not todo:
            break
    return [trace for trace in found if trace is not None]
