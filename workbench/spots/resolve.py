"""Spots that overlap: duplicates dropped, neighbours fitted together, a blob of two split by evidence."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations, product, starmap

import cv2
import numpy as np

from workbench.spots.cutting import half_for
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.gaussian import FLUX, LN_SU, SHEAR, U, principal_axes
from workbench.spots.joint import Joint, evidence, fit_joint, halves, hidden_spot
from workbench.spots.judging import without_outliers
from workbench.spots.measure import Trace, spot_flags
from workbench.spots.noise import Noise
from workbench.spots.pair import Scene
from workbench.spots.types import Bools, Failure, Floats, Spot

# F statistic that a second spot must reach: with some hundred pixels, chance gives this once in 1e5.
_EVIDENCE = 10.0
# Nearer than this, in widths, two spots move each other's centre.
_OVERLAP_WIDTHS = 4.0
_TAIL_WIDTHS = 2.5
_SAME_WIDTHS = 0.6
_MIN_APART_WIDTHS = 1.0
_MIN_SHARE = 0.08
_MIN_FLUX_SD = 5.0
_ELONGATED = 1.12
_LONGISH = 1.3
# A spot whose flux is known better than this is no spike of noise; a rival covers it within two widths.
CLEAR_SD = 7.0
_RIVAL_WIDTHS = 2.0
_MAX_HALF_PX = 30
_MAX_HIDDEN = 4
_TURNS = 2


def _apart_px(one: Trace, other: Trace) -> float:
    return float(np.hypot(*(one.params[U:LN_SU] - other.params[U:LN_SU])))


def are_apart(traces: list[Trace]) -> bool:
    """Whether no spot is a duplicate of another or disturbs it: the common case, told at once."""
    reach = max((t.reach_px for t in traces), default=0.0)
    limit = half_for(reach) + _TAIL_WIDTHS * reach
    places = [(t.spot.u_px, t.spot.v_px) for t in traces]
    return min(starmap(math.dist, combinations(places, 2)), default=limit) >= limit


def without_duplicates(traces: list[Trace]) -> list[Trace]:
    """Peaks whose fits ended on the same spot count once."""
    kept: list[Trace] = []
    for trace in sorted(traces, key=lambda t: -t.spot.flux_dn):
        if all(_apart_px(trace, k) > max(_SAME_WIDTHS * min(trace.reach_px, k.reach_px), 0.5) for k in kept):
            kept.append(trace)
    return kept


def clearest(old: list[Trace], new: list[Trace]) -> list[Trace]:
    """Old and new traces; of a faint old one and a new one at the same place only the clearer.

    A narrow fit may have settled on a spike of noise upon a wide faint spot, which is another maximum of the
    likelihood.
    """
    if not old:
        return new
    rivals = [
        (o, n)
        for o, n in product(old, new)
        if o.clarity < CLEAR_SD and _apart_px(o, n) < _RIVAL_WIDTHS * max(o.reach_px, n.reach_px)
    ]
    worse = {id(min(pair, key=lambda t: t.clarity)) for pair in rivals}
    return [t for t in (*old, *new) if id(t) not in worse]


def _disturbs(one: Trace, other: Trace) -> bool:
    """Whether light of one spot falls into the window of the other."""
    reach = max(one.reach_px, other.reach_px)
    return _apart_px(one, other) < half_for(reach) + _TAIL_WIDTHS * reach


def clusters(traces: list[Trace]) -> list[list[Trace]]:
    """Groups of spots that disturb each other, the strongest first in each."""
    groups: list[list[Trace]] = []
    for trace in traces:
        near = [g for g in groups if any(_disturbs(trace, t) for t in g)]
        groups = [g for g in groups if all(g is not n for n in near)]
        groups.append([*(t for g in near for t in g), trace])
    return [sorted(g, key=lambda t: -t.spot.flux_dn) for g in groups]


def _window(scene: Scene, points: Floats, reach_px: float) -> tuple[Windows, int, int]:
    """A window around all points (k, 2), and its first row and column."""
    u, v = 0.5 * (points.min(axis=0) + points.max(axis=0))
    half = min(half_for(reach_px) + int(np.ceil(0.5 * np.ptp(points, axis=0).max())), _MAX_HALF_PX)
    row0, col0 = round(float(v)) - half, round(float(u)) - half
    win = scene.pair.cut(np.array([row0 + half], float), np.array([col0 + half], float), np.array([0]), half)
    # What lies off the scanline is not explained by spots on it.
    size = 2 * int(np.ceil(_TAIL_WIDTHS * reach_px)) + 1
    allowed = _allowed(scene, win, row0, col0).astype(np.uint8)
    near = cv2.dilate(allowed, np.ones((size, size), np.uint8)).astype(bool)[None]
    return Windows(win.data, near & win.usable, win.clip_dn), row0, col0


def _noise(scene: Scene, group: list[Trace]) -> Noise:
    """To start from: of several measured slopes the lowest, for misfits only raise them."""
    return Noise(np.array([scene.variance]), np.array([min(t.slope_dn for t in group)]))


def _is_better(one: Joint, two: Joint, win: Windows) -> bool:
    """Whether the data ask for the spot that `two` has and `one` has not.

    `one` was fitted with the weights of `two`.
    """
    flux = two.params[:, FLUX]
    reach = float(np.exp(two.params[0, LN_SU:SHEAR].max()))
    points = two.params[:, U:LN_SU]
    apart = min(float(np.hypot(*(p - q))) for p, q in combinations(points, 2))
    inside = bool((points >= 0).all() and (points < np.array(win.shape[::-1])).all())
    pixels = int((two.weight > 0).sum())
    return (
        two.converged
        and inside
        and apart > _MIN_APART_WIDTHS * reach
        and float(flux.min()) > _MIN_SHARE * float(flux.max())
        and bool((flux > _MIN_FLUX_SD * two.sd[:, 0]).all())
        and evidence(one.chi2, two.chi2, pixels, 3 + 3 * len(flux)) > _EVIDENCE
    )


def _as_traces(scene: Scene, joint: Joint, row0: int, col0: int) -> list[Trace]:
    absolute = joint.params + np.array([0, 0, col0, row0, 0, 0])
    traces = []
    for i, (params, sd, flags) in enumerate(
        zip(absolute, joint.sd, spot_flags(scene, absolute), strict=True)
    ):
        _, flux, u, v, ln_su, ln_sv = params.tolist()
        reach = math.exp(max(ln_su, ln_sv))
        others = np.delete(absolute, i, axis=0)[:, U:LN_SU]
        apart = float(np.hypot(*(others - params[U:LN_SU]).T).min())
        if apart < _OVERLAP_WIDTHS * reach:
            flags |= {Failure.MERGED}
        width = math.exp(0.5 * (ln_su + ln_sv))
        peak = flux / (2.0 * math.pi * (width**2 + 1.0 / 12.0))
        spot = Spot(u, v, float(sd[1]), float(sd[2]), flux, width, peak, flags)
        traces.append(Trace(spot, params, float(joint.noise.slope_dn[0]), reach, flux / float(sd[0])))
    return traces


def fitted_together(scene: Scene, group: list[Trace], wants_more: bool) -> list[Trace]:
    """A cluster fitted jointly, the strongest first; members that the data do not ask for are dropped.

    Where more spots are wanted, longish members are tried as two.
    """
    if len(group) == 1:
        return group
    points = np.array([t.params[U:LN_SU] for t in group])
    win, row0, col0 = _window(scene, points, max(t.reach_px for t in group))
    start = np.array([t.params[:SHEAR] for t in group]) - (0, 0, col0, row0, 0, 0)
    noise = _noise(scene, group)
    halved = _halved(start) if wants_more else start
    if len(halved) > len(start):
        best, _ = _needed(win, halved, noise)
        if best is not None and len(best.params) > len(start):
            return _as_traces(scene, best, row0, col0)
    best, kept = _needed(win, start, noise)
    return [group[i] for i in kept] if best is None else _as_traces(scene, best, row0, col0)


def _needed(win: Windows, start: Floats, noise: Noise) -> tuple[Joint | None, list[int]]:
    """The fit of those of the spots that the data ask for, and their indices; no fit where one is left.

    All at first, then without the least certain one: to a model that lacks a spot its light is noise, and in
    that noise the others are lost, too.
    """
    kept = list(range(len(start)))
    while len(kept) > 1:
        full = _settled(win, start[kept], noise)
        flux, sd = full.params[:, FLUX], full.sd[:, 0]
        weakest = int(np.divide(flux, sd, out=np.zeros_like(flux), where=sd > 0).argmin())
        fewer = np.delete(full.params, weakest, axis=0)
        if _is_better(fit_joint(win, fewer, noise, full.weight), full, win):
            return full, kept
        del kept[weakest]
    return None, kept


def _halved(start: Floats) -> Floats:
    """First guesses in which longish spots are two."""
    narrowest = start[:, LN_SU:].min()
    long = start[:, LN_SU:].max(axis=1) > narrowest + np.log(_LONGISH)
    pairs = [halves(np.append(params, 0.0)) for params in start[long]]
    halved: Floats = np.vstack([start[~long], *pairs])
    halved[:, LN_SU:] = narrowest
    return halved


def grown(scene: Scene, group: list[Trace]) -> list[Trace]:
    """A cluster with the neighbours that hide in its residuals, as long as the data ask for them."""
    points = np.array([t.params[U:LN_SU] for t in group])
    win, row0, col0 = _window(scene, points, max(t.reach_px for t in group))
    start = np.array([t.params[:SHEAR] for t in group]) - (0, 0, col0, row0, 0, 0)
    noise = _noise(scene, group)
    allowed = _allowed(scene, win, row0, col0)
    best = fit_joint(win, start, noise)
    while len(best.params) < len(group) + _MAX_HIDDEN:
        hidden = hidden_spot(best, win, allowed)
        if hidden is None:
            break
        more = _settled(win, np.vstack([best.params, hidden]), noise)
        if not _is_better(fit_joint(win, best.params, noise, more.weight), more, win):
            break
        best = more
    return group if len(best.params) == len(group) else _as_traces(scene, best, row0, col0)


def _settled(win: Windows, start: Floats, noise: Noise) -> Joint:
    """Fit with the noise that the model itself measures, without pixels that no spot explains."""
    for _ in range(_TURNS):
        joint = fit_joint(win, start, noise)
        signal, residual, weight = (
            part.reshape(1, *win.shape) for part in (joint.signal, joint.residual, joint.weight)
        )
        largest = np.array([[(weight * residual**2).max()]])
        usable, _ = without_outliers(win.usable, signal, residual, weight, largest)
        win, start, noise = win._replace(usable=usable), joint.params, joint.noise
    return fit_joint(win, start, noise)


def _allowed(scene: Scene, win: Windows, row0: int, col0: int) -> Bools:
    """(height, width) where the scanline lets a spot be."""
    if scene.strip.mask is None:
        return np.ones(win.shape, bool)
    rows = np.arange(row0, row0 + win.shape[0]) - scene.strip.rows.start
    cols = np.arange(col0, col0 + win.shape[1]) - scene.strip.cols.start
    height, width = scene.strip.mask.shape
    inside = ((rows >= 0) & (rows < height))[:, None] & ((cols >= 0) & (cols < width))
    allowed: Bools = inside & scene.strip.mask[np.ix_(rows.clip(0, height - 1), cols.clip(0, width - 1))]
    return allowed


def split(scene: Scene, trace: Trace, others: list[Trace]) -> list[Trace]:
    """A spot as two if it is elongated and two explain it far better.

    Spots whose light mixes with that of others are left to the fit of all of them together.
    """
    if any(_apart_px(trace, o) < _TAIL_WIDTHS * (trace.reach_px + o.reach_px) for o in others):
        return [trace]
    win, row0, col0 = _window(scene, trace.params[None, U:LN_SU], 1.3 * trace.reach_px)
    win = win._replace(usable=win.usable & ~_light_of(others, win.shape, row0, col0))
    start = np.zeros((1, 7))
    start[0, : trace.params.size] = trace.params - (0, 0, col0, row0, 0, 0, 0)[: trace.params.size]
    noise = _noise(scene, [trace])
    whole = fit_spots(win, start, noise)
    usable, changed = without_outliers(win.usable, whole.signal, whole.residual, whole.weight, whole.judged)
    if changed:
        win = win._replace(usable=usable)
        whole = fit_spots(win, start, noise)
    short, long = principal_axes(whole.params[0])[0]
    if not whole.converged[0] or long < _ELONGATED * short:
        return [trace]
    two = _settled(win, halves(whole.params[0]), noise)
    one = float(two.weight @ whole.residual.ravel() ** 2)
    if not _is_better(replace(two, chi2=one), two, win):
        return [trace]
    return _as_traces(scene, two, row0, col0)


def _light_of(traces: list[Trace], shape: tuple[int, int], row0: int, col0: int) -> Bools:
    """(height, width) where light of the spots comes."""
    light = np.zeros(shape, bool)
    rows, cols = np.mgrid[row0 : row0 + shape[0], col0 : col0 + shape[1]]
    for t in traces:
        light |= np.hypot(cols - t.spot.u_px, rows - t.spot.v_px) < _TAIL_WIDTHS * t.reach_px
    return light
