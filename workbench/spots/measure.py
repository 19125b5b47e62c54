"""From peaks to measured spots: cut windows, fit them together, keep what is a spot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from workbench.spots.detect import FINE_PX, Peaks
from workbench.spots.fit import Fit, Windows, fit_spots
from workbench.spots.gaussian import FLUX, LN_SU, LN_SV, SHEAR, U, V, sheared
from workbench.spots.noise import Noise
from workbench.spots.pair import Scene
from workbench.spots.types import Failure, Floats, Spot

Ints = NDArray[np.intp]
# Half-widths of windows; each holds spots whose width is up to (half - 1) / 3: what lies beyond 3 widths tells
# nothing about the position.
_HALVES_PX: Final = (6, 9, 13, 19)
# Narrower than any lens makes a spot: a hot pixel. (A pixel integrates; 0 is possible, 0.6 the least specified.)
_MIN_WIDTH_PX = 0.4
_MAX_WIDTH_PX = 7.0
_MIN_FLUX_SD = 5.0
_EDGE_WIDTHS = 2.5
_OUTLIER_SD = 6.0
_MAX_OUTLIERS = 3
_SHEAR_SD = 5.0
# Electrons that fill a pixel: only the first guess of the photon-transfer slope, which is then measured.
_FULL_WELL_ELECTRONS = 1e4
_MIN_FULL_SCALE_DN = 255.0


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
        return float(np.exp(self.params[LN_SU:SHEAR].max()))


def half_for(width_px: float) -> int:
    """Half-width of the window for a spot."""
    return next((half for half in _HALVES_PX if half >= 3.0 * width_px + 1.0), _HALVES_PX[-1])


def first_guess(win: Windows, peaks: Peaks, half: int) -> Floats:
    """(n, 6) start: width from the number of pixels above half the peak (2 pi ln 2 widths squared)."""
    n = len(win.data)
    start = np.zeros((n, 6))
    if peaks.scale_px > FINE_PX:
        width = np.full(n, peaks.scale_px)
        start[:, U:LN_SU] = half
        start[:, FLUX] = peaks.height_dn * 4.0 * np.pi * peaks.scale_px**2
    else:
        height = win.data.max(axis=1)
        above = np.maximum(win.data - 0.5 * height[:, None], 0.0)
        span = np.arange(2 * half + 1.0)
        moments = (
            above @ np.stack([np.ones(span.size**2), np.tile(span, span.size), np.repeat(span, span.size)]).T
        )
        width = np.sqrt(np.count_nonzero(above, axis=1) / (2.0 * np.pi * np.log(2.0)))
        start[:, U:LN_SU] = moments[:, 1:] / moments[:, :1]
        start[:, FLUX] = height * 2.0 * np.pi * (width**2 + 0.08)
    start[:, LN_SU:] = np.log(width)[:, None]
    return start


def _outliers_left_out(win: Windows, fit: Fit) -> Windows | None:
    """The windows without a few pixels that no model of a spot explains (hot pixels); None if there are none."""
    far = fit.residual**2 * fit.weight > _OUTLIER_SD**2
    few = far & (far.sum(axis=1, keepdims=True) <= _MAX_OUTLIERS)
    few &= np.abs(fit.residual) > 0.1 * fit.signal.max(axis=1, keepdims=True)
    if not few.any():
        return None
    usable = ~few if win.usable is None else win.usable & ~few
    return Windows(win.data, win.shape, usable, win.clip_dn)


def _local_floor(fit: Fit) -> Floats:
    """(n, 1) floor of each window: that of the strip, raised where the window's dark pixels are noisier.

    Clutter and bright surroundings do that. The threshold is 4 sd of the estimate, so that an even scene keeps
    the strip's, which is known better.
    """
    floor = fit.noise.floor_dn2
    dark = (fit.weight > 0) & (fit.signal * fit.noise.slope_dn < 0.2 * floor)
    count = np.maximum(dark.sum(axis=1, keepdims=True), 1)
    measured = (dark * fit.residual**2).sum(axis=1, keepdims=True) / count
    raised: Floats = np.where(measured > floor * (1.0 + 4.0 * np.sqrt(2.0 / count)), measured, floor)
    return raised


def _refined(win: Windows, fit: Fit) -> tuple[Windows, Fit]:
    """The fit again where its residuals ask for it: hot pixels, a noisier surrounding."""
    cleaned = _outliers_left_out(win, fit)
    if cleaned is not None:
        win = cleaned
        fit = fit_spots(win, fit.params, fit.noise)
    floor = _local_floor(fit)
    if (floor > fit.noise.floor_dn2).any():
        fit = fit_spots(win, fit.params, Noise(floor, fit.noise.slope_dn))
    return win, fit


def _tilted(win: Windows, fit: Fit, i: int) -> Fit | None:
    """Fit of spot `i` as an ellipse at any angle, if the residuals show that it is one."""
    rows, weight = fit.rows[i], fit.weight[i]
    mixed = rows[U] * rows[V] / np.maximum(rows[FLUX], 1e-12)
    told = float(np.sqrt(weight @ mixed**2))
    if abs(float((weight * mixed) @ fit.residual[i])) <= _SHEAR_SD * told:
        return None
    one = slice(i, i + 1)
    usable = None if win.usable is None else win.usable[one]
    clip = None if win.clip_dn is None else win.clip_dn[one]
    start = np.append(fit.params[one], [[0.0]], axis=1)
    noise = Noise(fit.noise.floor_dn2[one], fit.noise.slope_dn)
    again = fit_spots(Windows(win.data[one], win.shape, usable, clip), start, noise, sheared)
    return again if again.converged[0] else None


def spot_flags(scene: Scene, u: float, v: float, su: float, sv: float) -> frozenset[Failure]:
    """What can be told about a spot from its place: cut by the border, clipped."""
    height, width = scene.pair.on.shape
    flags = set()
    if min(u, width - 1 - u) < _EDGE_WIDTHS * su or min(v, height - 1 - v) < _EDGE_WIDTHS * sv:
        flags.add(Failure.AT_EDGE)
    rows = slice(max(round(v - 2 * sv), 0), max(round(v + 2 * sv) + 1, 0))
    cols = slice(max(round(u - 2 * su), 0), max(round(u + 2 * su) + 1, 0))
    if (scene.pair.on[rows, cols] >= scene.pair.clip_dn).any():
        flags.add(Failure.SATURATED)
    return frozenset(flags)


def _trace(scene: Scene, fit: Fit, i: int, row0: int, col0: int) -> Trace | None:
    """Spot `i` of a fit, None if it is no spot."""
    params = fit.params[i].copy()
    flux = float(params[FLUX])
    # Of a spot whose place and shape were known: whether anything is there is not a question of its width.
    flux_sd = float(fit.weight[i] @ fit.rows[i, FLUX] ** 2 + 1e-30) ** -0.5
    if not fit.converged[i] or not np.isfinite(params).all() or flux <= _MIN_FLUX_SD * flux_sd:
        return None
    width = float(np.exp(0.5 * (params[LN_SU] + params[LN_SV])))
    if not _MIN_WIDTH_PX <= width <= _MAX_WIDTH_PX:
        return None
    params[U] += col0
    params[V] += row0
    u, v = float(params[U]), float(params[V])
    height, span = scene.pair.on.shape
    if not (-0.5 <= u <= span - 0.5 and -0.5 <= v <= height - 0.5):
        return None
    u_sd, v_sd = fit.sd_px[i]
    su, sv = np.exp(params[LN_SU:SHEAR])
    flags = spot_flags(scene, u, v, float(su), float(sv))
    peak = float(fit.signal[i].max())
    return Trace(Spot(u, v, float(u_sd), float(v_sd), flux, width, peak, flags), params, fit.noise.slope_dn)


def _fit_group(scene: Scene, rows: Ints, cols: Ints, start: Floats, half: int) -> tuple[Windows, Fit]:
    """Fit spots that share a size of window; `start` counts from the image's first pixel."""
    win = scene.pair.cut(rows, cols, half)
    local = start.copy()
    local[:, U] -= cols - half
    local[:, V] -= rows - half
    slope = max(float(win.data.max()), _MIN_FULL_SCALE_DN) / _FULL_WELL_ELECTRONS
    noise = Noise(np.full((len(rows), 1), scene.variance), slope)
    return _refined(win, fit_spots(win, local, noise))


def measure(scene: Scene, peaks: Peaks) -> list[Trace]:
    """Fit every peak and keep those that are spots."""
    rows, cols = peaks.rows, peaks.cols
    if rows.size == 0:
        return []
    half = _HALVES_PX[0]
    start = first_guess(scene.pair.cut(rows, cols, half), peaks, half)
    start[:, U] += cols - half
    start[:, V] += rows - half
    sizes = np.array([half_for(float(w)) for w in np.exp(start[:, LN_SU])])
    todo = np.arange(rows.size)
    traces: dict[int, Trace | None] = {}
    for _ in range(3):
        again: list[int] = []
        for half in np.unique(sizes[todo]):
            group = todo[sizes[todo] == half]
            win, fit = _fit_group(scene, rows[group], cols[group], start[group], int(half))
            for i, k in enumerate(group):
                row0, col0 = int(rows[k]) - int(half), int(cols[k]) - int(half)
                moved = np.abs(fit.params[i, U:LN_SU] - half).max() > 1.5
                wanted = half_for(float(np.exp(fit.params[i, LN_SU:SHEAR].max())))
                tilted = _tilted(win, fit, i)
                traces[k] = _trace(scene, tilted or fit, 0 if tilted else i, row0, col0)
                if (moved or wanted > half) and traces[k] is not None:
                    again.append(k)
                    start[k] = fit.params[i] + (0, 0, col0, row0, 0, 0)
                    rows[k], cols[k] = round(float(start[k, V])), round(float(start[k, U]))
                    sizes[k] = max(wanted, half)
        todo = np.array(again, np.intp)
        if todo.size == 0:
            break
    return [trace for k in sorted(traces) if (trace := traces[k]) is not None]
