"""From a pair of frames to spots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.spots.detect import SCALES_PX, Floats32, level_and_sd, peaks, rough_width_px
from workbench.spots.fit import Fitted, Noise, Windows, fit_spots
from workbench.spots.frames import check_pair, default_saturation_dn
from workbench.spots.gaussian import Param
from workbench.spots.types import Failure, Finding, Image, Scanline, Spot

_MAX_CANDIDATES = 64
_MIN_HALF_PX, _MAX_HALF_PX = 4, 14
_MIN_WIDTH_PX = 0.4
_FULL_WELL_ELECTRONS = 1e4
_ACCEPT_SD = 5.0


def _distance_px(line: Scanline, u: float, v: float) -> float:
    norm = float(np.hypot(line.du, line.dv))
    return abs((u - line.u0_px) * line.dv - (v - line.v0_px) * line.du) / norm


def _windows(
    diff: Floats32, on: Image, centres: list[tuple[int, int]], half: int, saturation_dn: float
) -> Windows:
    span = np.arange(-half, half + 1)
    rows = np.array([c[0] for c in centres])[:, None] + span
    cols = np.array([c[1] for c in centres])[:, None] + span
    height, width = diff.shape
    inside = ((rows >= 0) & (rows < height))[:, :, None] & ((cols >= 0) & (cols < width))[:, None, :]
    at = (np.clip(rows, 0, height - 1)[:, :, None], np.clip(cols, 0, width - 1)[:, None, :])
    data = diff[at].astype(np.float64)
    raw = on[at].astype(np.float64)
    usable = inside & (raw < saturation_dn)
    n = len(centres)
    flat = (n, -1)
    side = 2 * half + 1
    return Windows(
        data.reshape(flat), usable.reshape(flat), (side, side), (data + (saturation_dn - raw)).reshape(flat)
    )


def _fit_one(
    diff: Floats32, on: Image, row: int, col: int, noise: Noise, sat: float
) -> tuple[Fitted, int, int] | None:
    half = 6
    for _ in range(4):
        win = _windows(diff, on, [(row, col)], half, sat)
        usable = win.usable[0]
        if usable.sum() < 8:
            return None
        border = float(np.median(win.data[0]))
        width = rough_width_px(win.data[0], border)
        height = max(float(win.data[0].max()) - border, 1e-6)
        start = np.array([[border, height * 2 * np.pi * width**2, half, half, np.log(width), np.log(width)]])
        fit = fit_spots(win, start, noise)
        p = fit.params[0]
        du, dv = p[Param.U] - half, p[Param.V] - half
        wanted = int(np.clip(np.ceil(3 * np.exp(p[4:].max())) + 1, _MIN_HALF_PX, _MAX_HALF_PX))
        origin = row - half, col - half
        if max(abs(du), abs(dv)) <= 0.75 and wanted == half:
            break
        if max(abs(du), abs(dv)) > 2 * half:
            return None
        half, row, col = wanted, row + round(float(dv)), col + round(float(du))
    return fit, *origin


def _spot(fit: Fitted, row0: int, col0: int, shape: tuple[int, int], on: Image, sat: float) -> Spot | None:
    p, cov = fit.params[0], fit.cov[0]
    flux = p[Param.FLUX]
    if not np.isfinite(p).all() or flux <= 0 or not fit.converged[0]:
        return None
    sd = np.sqrt(np.abs(np.diag(cov)))
    width = float(np.exp(0.5 * (p[4] + p[5])))
    u, v = float(p[2]) + col0, float(p[3]) + row0
    if flux < _ACCEPT_SD * sd[Param.FLUX] or width < _MIN_WIDTH_PX:
        return None
    if not (-0.5 <= u <= shape[1] - 0.5 and -0.5 <= v <= shape[0] - 0.5):
        return None
    peak = float(flux * fit.basis[0, Param.FLUX].max())
    flags = set()
    reach = 2.0 * width
    if min(u, v, shape[1] - 1 - u, shape[0] - 1 - v) < reach:
        flags.add(Failure.AT_EDGE)
    r, c = round(v), round(u)
    if (on[max(r - 3, 0) : r + 4, max(c - 3, 0) : c + 4] >= sat).any():
        flags.add(Failure.SATURATED)
    return Spot(u, v, float(sd[2] / flux), float(sd[3] / flux), float(flux), width, peak, frozenset(flags))


def find_spots(
    on: Image,
    off: Image | None = None,
    *,
    scanlines: Sequence[Scanline] = (),
    expected: int | None = None,
    saturation_dn: int | None = None,
) -> Finding:
    """Find laser spots in a frame with the lasers on, or in the difference to one with the lasers off."""
    on, off = check_pair(on, off)
    sat = default_saturation_dn(on) if saturation_dn is None else saturation_dn
    diff = on.astype(np.float32)
    if off is not None:
        diff -= off
    level, sd = level_and_sd(diff, floor_sd=0.3)
    noise = Noise(sd**2, sat / _FULL_WELL_ELECTRONS)
    failures: list[Failure] = []
    if off is not None and abs(level) > max(1.0, 0.5 * sd):
        failures.append(Failure.AMBIENT_CHANGED)
    spots: list[Spot] = []
    for scale in SCALES_PX:
        for row, col, _ in peaks(diff, scale)[:_MAX_CANDIDATES]:
            if any(np.hypot(s.u_px - col, s.v_px - row) < 3 * s.width_px + 1 for s in spots):
                continue
            if scanlines and not any(_distance_px(li, col, row) <= li.half_width_px + 2 for li in scanlines):
                continue
            fitted = _fit_one(diff, on, row, col, noise, sat)
            spot = fitted and _spot(*fitted, diff.shape, on, sat)
            if not spot or any(np.hypot(s.u_px - spot.u_px, s.v_px - spot.v_px) < 1.0 for s in spots):
                continue
            if scanlines and not any(
                _distance_px(li, spot.u_px, spot.v_px) <= li.half_width_px for li in scanlines
            ):
                failures.append(Failure.OFF_SCANLINE)
                continue
            spots.append(spot)
    if not spots:
        failures.append(Failure.NO_SPOT)
    elif expected is not None and len(spots) != expected:
        failures.append(Failure.TOO_FEW if len(spots) < expected else Failure.TOO_MANY)
    for flag in (Failure.SATURATED, Failure.AT_EDGE, Failure.MERGED):
        if any(flag in s.flags for s in spots):
            failures.append(flag)
    if scanlines:
        line = scanlines[0]
        spots.sort(key=lambda s: s.u_px * line.du + s.v_px * line.dv)
    else:
        spots.sort(key=lambda s: (s.u_px, s.v_px))
    return Finding(tuple(spots), tuple(dict.fromkeys(failures)))
