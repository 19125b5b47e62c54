"""From peaks to measured spots: cut windows, fit them together, keep what is a spot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from workbench.spots.detect import FINE_PX, Peaks
from workbench.spots.fit import Fit, Windows, fit_spots
from workbench.spots.gaussian import FLUX, LN_SU, SHEAR, Sheared, U, Upright, V
from workbench.spots.noise import Noise
from workbench.spots.pair import Scene
from workbench.spots.types import NO_FLAGS, Bools, Failure, Floats, Spot

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
_PER_HALF_HEIGHT: Final = 1.0 / (2.0 * np.pi * np.log(2.0))


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
        return float(np.exp(max(self.params[LN_SU:SHEAR].tolist())))


def half_for(width_px: float) -> int:
    """Half-width of the window for a spot."""
    return next((half for half in _HALVES_PX if half >= _REACH_WIDTHS * width_px + 0.5), _HALVES_PX[-1])


def _moment_matrix(half: int) -> Floats:
    """(pixels, 3): one, u and v of each pixel of a window."""
    span = np.arange(2.0 * half + 1.0)
    return np.stack([np.ones(span.size**2), np.tile(span, span.size), np.repeat(span, span.size)], axis=1)


_MOMENTS: Final = {half: _moment_matrix(half) for half in _HALVES_PX}


def first_guess(win: Windows, peaks: Peaks, half: int) -> Floats:
    """(n, 6) start: width from the number of pixels above half the peak (2 pi ln 2 widths squared)."""
    data = win.data if win.usable is None else win.data * win.usable
    flat = data.reshape(len(data), -1)
    start = np.zeros((len(flat), 6))
    if peaks.scale_px > FINE_PX:
        start[:, U:LN_SU] = half
        start[:, FLUX] = peaks.height_dn * (4.0 * np.pi * peaks.scale_px**2)
        start[:, LN_SU:] = np.log(peaks.scale_px)
        return start
    height = np.maximum.reduce(flat, 1)
    above = flat - 0.5 * height[:, None]
    np.maximum(above, 0.0, out=above)
    moments = above @ _MOMENTS[half]
    square = np.add.reduce(above > 0, 1) * _PER_HALF_HEIGHT
    start[:, U:LN_SU] = moments[:, 1:] / np.maximum(moments[:, :1], 1e-9)
    start[:, FLUX] = height * (2.0 * np.pi) * (square + 0.08)
    start[:, LN_SU:] = 0.5 * np.log(np.maximum(square, 0.1))[:, None]
    return start


def without_outliers(win: Windows, fit: Fit) -> Windows | None:
    """The windows without a few pixels that no spot explains (hot pixels); None if there are none."""
    excess = fit.residual * fit.residual
    excess *= fit.weight
    if excess.max() <= _OUTLIER_SD**2:
        return None
    far = excess > _OUTLIER_SD**2
    few = far & (far.sum(axis=(1, 2), keepdims=True) <= _MAX_OUTLIERS)
    few &= np.abs(fit.residual) > 0.1 * fit.signal.max(axis=(1, 2), keepdims=True)
    if not few.any():
        return None
    return Windows(win.data, ~few if win.usable is None else win.usable & ~few, win.clip_dn)


def _rim_ratio(fit: Fit) -> Floats:
    """(n,) mean square of the residuals at the window's rim over the predicted variance."""
    excess = fit.residual * fit.residual
    excess *= fit.weight
    inner = np.add.reduce(excess[:, 1:-1, 1:-1], (1, 2))
    ratio: Floats = (np.add.reduce(excess, (1, 2)) - inner) / (4 * (excess.shape[1] - 1))
    return ratio


def _local_floor(fit: Fit) -> Floats | None:
    """(n, 1, 1) floor of each window, raised where its rim is noisier than predicted; None if nowhere.

    Clutter and bright surroundings do that. The threshold is 5 sd of the estimate, so that an even scene
    keeps the strip's floor, which is known better.
    """
    ratio = _rim_ratio(fit)
    noisy = ratio > 1.0 + 5.0 * (2.0 / (4 * (fit.residual.shape[1] - 1))) ** 0.5
    if not noisy.any():
        return None
    floor: Floats = fit.noise.floor_dn2 * np.where(noisy, ratio, 1.0)[:, None, None]
    return floor


def _refined(win: Windows, fit: Fit, guess: Noise) -> tuple[Windows, Fit]:
    """The fit again where its residuals ask for it: hot pixels, a noisier surrounding."""
    cleaned = without_outliers(win, fit)
    if cleaned is not None:
        win = cleaned
        fit = fit_spots(win, fit.params, guess)
    floor = _local_floor(fit)
    if floor is not None:
        fit = fit_spots(win, fit.params, Noise(floor, guess.slope_dn))
    return win, fit


def _tilted(fit: Fit) -> Bools:
    """(n,) whether the residuals of upright ellipses show that the spot's axes are at an angle."""
    if not isinstance(fit.design, Upright):
        return np.zeros(len(fit.params), bool)
    of_u, of_v = fit.design.along_u[1][:, :, None], fit.design.along_v[1][:, None, :]
    score = (of_v @ (fit.weight * fit.residual) @ of_u)[:, 0, 0]
    told = ((of_v * of_v) @ fit.weight @ (of_u * of_u))[:, 0, 0]
    tilted: Bools = score * score > _SHEAR_SD**2 * told
    return tilted


def _fit_tilted(win: Windows, fit: Fit, i: int, guess: Noise) -> Fit | None:
    """Fit of spot `i` as an ellipse at any angle; None if that does not converge."""
    one = slice(i, i + 1)
    start = np.append(fit.params[one], [[0.0]], axis=1)
    again = fit_spots(win.only(one), start, Noise(fit.noise.floor_dn2[one], guess.slope_dn[one]), Sheared)
    return again if again.converged[0] else None


def spot_flags(scene: Scene, u: float, v: float, su: float, sv: float) -> frozenset[Failure]:
    """What can be told about a spot from its place: cut by the border, clipped."""
    height, width = scene.pair.on.shape
    at_edge = min(u, width - 1 - u) < _EDGE_WIDTHS * su or min(v, height - 1 - v) < _EDGE_WIDTHS * sv
    rows = slice(max(round(v - 2 * sv), 0), max(round(v + 2 * sv) + 1, 0))
    cols = slice(max(round(u - 2 * su), 0), max(round(u + 2 * su) + 1, 0))
    around = scene.pair.on[rows, cols]
    clipped = around.size > 0 and around.max() >= scene.pair.clip_dn
    if not at_edge and not clipped:
        return NO_FLAGS
    return frozenset(f for f, told in ((Failure.AT_EDGE, at_edge), (Failure.SATURATED, clipped)) if told)


def _are_spots(fit: Fit, params: Floats, shape: tuple[int, int]) -> Bools:
    """(n,) whether a fit ended on something that can be a spot inside the image."""
    # Of a spot whose place and shape were known: whether anything is there is not a question of its width.
    told = np.add.reduce(fit.weight * fit.design.unit**2, (1, 2)) / np.maximum(_rim_ratio(fit), 1.0)
    flux = params[:, FLUX]
    width = np.exp(0.5 * (params[:, 4] + params[:, 5]))
    u, v = params[:, U], params[:, V]
    ok = fit.converged & (flux > 0) & (flux * flux * told > _MIN_FLUX_SD**2)
    # ... but a swelling of the background is not one: there flux and background cannot be told apart.
    ok &= flux * flux > _MIN_TOLD_SD**2 * fit.cov[:, FLUX, FLUX]
    ok &= (width >= _MIN_WIDTH_PX) & (width <= _MAX_WIDTH_PX)
    ok &= (u >= -0.5) & (u <= shape[1] - 0.5) & (v >= -0.5) & (v <= shape[0] - 0.5)
    spots: Bools = ok
    return spots


def _traces(scene: Scene, fit: Fit, params: Floats) -> list[Trace | None]:
    """What a fit found; None where it is no spot. `params` count from the image's first pixel."""
    peaks = fit.signal.max(axis=(1, 2)).tolist()
    sds = fit.sd_px.tolist()
    slopes = fit.noise.slope_dn[:, 0, 0].tolist()
    widths = np.exp(params[:, LN_SU:SHEAR])
    means = np.sqrt(widths[:, 0] * widths[:, 1]).tolist()
    found: list[Trace | None] = []
    ok = _are_spots(fit, params, scene.pair.on.shape).tolist()
    for i, (_, flux, u, v, *_) in enumerate(params.tolist()):
        if not ok[i]:
            found.append(None)
            continue
        flags = spot_flags(scene, u, v, *widths[i].tolist())
        spot = Spot(u, v, sds[i][0], sds[i][1], flux, means[i], peaks[i], flags)
        found.append(Trace(spot, params[i], slopes[i]))
    return found


def _apart(win: Windows, rows: Ints, cols: Ints, group: Ints, half: int) -> Windows:
    """The windows of some peaks without the pixels that lie nearer to another peak."""
    dv, du = rows - rows[group, None], cols - cols[group, None]
    square = dv * dv + du * du
    near = (square > 0) & (square <= (2 * half) ** 2)
    if not near.any():
        return win
    usable = np.ones(win.data.shape, bool) if win.usable is None else win.usable.copy()
    span = np.arange(-half, half + 1)
    for i, k in zip(*np.nonzero(near), strict=True):
        usable[i] &= 2 * (span[:, None] * dv[i, k] + span * du[i, k]) <= square[i, k]
    return Windows(win.data, usable, win.clip_dn)


def _fit_group(
    scene: Scene, rows: Ints, cols: Ints, group: Ints, start: Floats, half: int
) -> tuple[Floats, list[Trace | None]]:
    """Fit spots that share a size of window; all parameters count from the image's first pixel."""
    win = _apart(scene.pair.cut(rows[group], cols[group], half), rows, cols, group, half)
    origin = np.zeros((len(group), 6))
    origin[:, U] = cols[group] - half
    origin[:, V] = rows[group] - half
    each = np.ones((len(group), 1, 1))
    noise = Noise(scene.variance * each, scene.pair.clip_dn / _FULL_WELL_ELECTRONS * each)
    win, fit = _refined(win, fit_spots(win, start - origin, noise), noise)
    params = fit.params + origin
    traces = _traces(scene, fit, params)
    for i in np.flatnonzero(_tilted(fit)):
        again = _fit_tilted(win, fit, int(i), noise)
        if again is not None:
            traces[i] = _traces(scene, again, again.params + np.append(origin[i], 0.0))[0]
    return params, traces


def measure(scene: Scene, peaks: Peaks) -> list[Trace]:
    """Fit every peak and keep those that are spots."""
    rows, cols = peaks.rows.copy(), peaks.cols.copy()
    if rows.size == 0:
        return []
    half = _HALVES_PX[0]
    todo = np.arange(rows.size)
    start = first_guess(_apart(scene.pair.cut(rows, cols, half), rows, cols, todo, half), peaks, half)
    start[:, U] += cols - half
    start[:, V] += rows - half
    scatter = _GUESSED if peaks.scale_px == FINE_PX else 1.0
    sizes = np.array([half_for(scatter * w) for w in np.exp(start[:, LN_SU]).tolist()])
    found: list[Trace | None] = [None] * rows.size
    for _ in range(3):
        again = []
        for half in sorted(set(sizes[todo].tolist())):
            group = todo[sizes[todo] == half]
            params, traces = _fit_group(scene, rows, cols, group, start[group], half)
            wanted = [half_for(_OUTGROWN * w) for w in np.exp(params[:, LN_SU:SHEAR].max(axis=1)).tolist()]
            moved = np.maximum(np.abs(params[:, U] - cols[group]), np.abs(params[:, V] - rows[group]))
            for i, k in enumerate(group.tolist()):
                found[k] = traces[i] or found[k]
                if traces[i] is not None and (wanted[i] > half or moved[i] > _OFF_CENTRE_PX):
                    again.append(k)
                    start[k] = params[i]
                    rows[k], cols[k] = round(params[i, V]), round(params[i, U])
                    sizes[k] = max(wanted[i], half)
        todo = np.array(again, np.intp)
        if todo.size == 0:
            break
    return [trace for trace in found if trace is not None]
