"""Spots whose light mixes: fitted together, a blob split in two, hidden ones found, all by evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.spot import Failure, Spot
from workbench.spots.deblending.clusters import TAIL_WIDTHS, mixes, stands_alone
from workbench.spots.deblending.joint_fit import JointFit, evidence, fit_joint, halves, hidden_spot
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.acceptance import without_outliers
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR, U
from workbench.spots.kernels.windows import half_for, mark_light, mark_strip
from workbench.spots.measure import FittedSpot, spot_flags
from workbench.spots.noise import PixelNoise
from workbench.spots.pair import PairSignal
from workbench.spots.psf import principal_axes

# F statistic that a further spot must reach: with some hundred pixels, chance gives this once in 1e5.
_EVIDENCE = 10.0
# Nearer than this, in widths, two spots move each other's centre.
_OVERLAP_WIDTHS = 4.0
_MIN_APART_WIDTHS = 1.0
_MIN_SHARE = 0.08
_MIN_FLUX_SD = 5.0
_ELONGATED = 1.12
_LONGISH = 1.3
_MAX_HALF_PX = 120
_MAX_HIDDEN = 4
_TURNS = 2
_NO_MASK = np.zeros((0, 0), bool)


class Blend:
    """Spots that are fitted in one window, and what lies around them.

    Args:
        scenes: The strips that are searched: what lies in none of them is not explained.
        group: The spots, at least one.
        others: All other spots: where their light comes, no pixel is used.
        reach_px: Width that the window is made for; that of the widest spot if None.
    """

    def __init__(
        self,
        scenes: Sequence[PairSignal],
        group: Sequence[FittedSpot],
        others: Sequence[FittedSpot],
        reach_px: float | None = None,
    ) -> None:
        self.scene = group[0].scene
        # To start from: of several measured slopes the lowest, for misfits only raise them.
        slope = min(t.slope_dn for t in group)
        self.noise = PixelNoise(np.array([self.scene.variance]), np.array([slope]))
        points = np.array([t.params[U:LN_SU] for t in group])
        reach = reach_px or max(t.reach_px for t in group)
        u, v = 0.5 * (points.min(axis=0) + points.max(axis=0))
        half = half_for(reach) + int(np.ceil(0.5 * np.ptp(points, axis=0).max()))
        self.fits = half <= _MAX_HALF_PX
        half = min(half, _MAX_HALF_PX)
        self.row0, self.col0 = round(float(v)) - half, round(float(u)) - half
        centre = np.array([self.row0 + half], float), np.array([self.col0 + half], float)
        win = self.scene.pair.cut(*centre, np.array([0]), half)
        elsewhere = ~self._light_of(others, win.shape)
        self.allowed: BoolArray = self._in_a_strip(scenes, win.shape) & elsewhere
        # What lies off the scanline is not explained by spots on it.
        size = 2 * int(np.ceil(TAIL_WIDTHS * reach)) + 1
        near = cv2.dilate(self.allowed.astype(np.uint8), np.ones((size, size), np.uint8)).astype(bool)
        self.win = win._replace(usable=(near & elsewhere)[None] & win.usable)
        """A window around all of them."""

    def start_of(self, traces: Sequence[FittedSpot]) -> FloatArray:
        """(n, 6) their parameters, in pixels of the window."""
        return np.array([t.params[:SHEAR] for t in traces]) - (0, 0, self.col0, self.row0, 0, 0)

    def as_traces(self, joint: JointFit) -> list[FittedSpot]:
        """The spots of a fit, in pixels of the image."""
        absolute = joint.params + np.array([0, 0, self.col0, self.row0, 0, 0])
        traces = []
        for i, (params, sd, flags) in enumerate(
            zip(absolute, joint.sd, spot_flags(self.scene, absolute), strict=True)
        ):
            _, flux, u, v, ln_su, ln_sv = params.tolist()
            reach = math.exp(max(ln_su, ln_sv))
            others = np.delete(absolute, i, axis=0)[:, U:LN_SU]
            if (np.hypot(*(others - params[U:LN_SU]).T) < _OVERLAP_WIDTHS * reach).any():
                flags |= {Failure.MERGED}
            width = math.exp(0.5 * (ln_su + ln_sv))
            peak = flux / (2.0 * math.pi * (width**2 + 1.0 / 12.0))
            spot = Spot(u, v, float(sd[1]), float(sd[2]), flux, width, peak, flags)
            slope = float(joint.noise.slope_dn[0])
            traces.append(FittedSpot(spot, params, slope, reach, flux / float(sd[0]), self.scene))
        return traces

    def _light_of(self, traces: Sequence[FittedSpot], shape: tuple[int, int]) -> BoolArray:
        """(height, width) where light of these spots comes."""
        found = np.zeros(shape, bool)
        if traces:
            lights = np.array([(t.spot.u_px, t.spot.v_px, TAIL_WIDTHS * t.reach_px) for t in traces])
            mark_light(self.row0, self.col0, lights, found)
        return found

    def _in_a_strip(self, scenes: Sequence[PairSignal], shape: tuple[int, int]) -> BoolArray:
        """(height, width) where a scanline lets a spot be."""
        found = np.zeros(shape, bool)
        for strip in (scene.strip for scene in scenes):
            rows, cols = (strip.rows.start, strip.rows.stop), (strip.cols.start, strip.cols.stop)
            mask = _NO_MASK if strip.mask is None else strip.mask
            mark_strip(self.row0, self.col0, rows, cols, mask, found)
        return found


class _Asked(NamedTuple):
    """Spots that a fit has more than another, and what share of the strongest's flux they must have."""

    which: list[int]
    least_share: float


def _is_better(one: JointFit, two: JointFit, win: Windows, asked: _Asked) -> bool:
    """Whether the data ask for the spots that `two` has and `one` has not.

    `one` was fitted with the weights of `two`.
    """
    flux, points = two.params[:, FLUX], two.params[:, U:LN_SU]
    reach = float(np.exp(two.params[0, LN_SU:SHEAR].max()))
    apart = min(
        float(np.hypot(*(points[i] - points[j])))
        for i, j in combinations(range(len(points)), 2)
        if i in asked.which or j in asked.which
    )
    return (
        _is_sound(two, win)
        and apart > _MIN_APART_WIDTHS * reach
        and float(flux[asked.which].min()) > asked.least_share * float(flux.max())
        and bool((flux > _MIN_FLUX_SD * two.sd[:, 0])[asked.which].all())
        and evidence(one.chi2, two.chi2, int((two.weight > 0).sum()), 3 + 3 * len(flux)) > _EVIDENCE
    )


def _is_sound(joint: JointFit, win: Windows) -> bool:
    points = joint.params[:, U:LN_SU]
    return joint.converged and bool((points >= 0).all() and (points < np.array(win.shape[::-1])).all())


def fit_blends(
    scenes: Sequence[PairSignal], group: list[FittedSpot], others: Sequence[FittedSpot], wants_more: bool
) -> list[FittedSpot]:
    """A cluster fitted jointly, the strongest first; members that the data do not ask for are dropped.

    Where more spots are wanted, longish members are tried as two.
    """
    if len(group) == 1:
        return group
    crowd = Blend(scenes, group, others)
    if not crowd.fits:
        return group
    start = crowd.start_of(group)
    alone = np.array([stands_alone(t, [o for o in group if o is not t]) for t in group])
    if wants_more:
        best, _ = _needed(crowd, *_halved(start, alone))
        if best is not None and len(best.params) > len(start):
            return crowd.as_traces(best)
    best, kept = _needed(crowd, start, alone)
    return [group[i] for i in kept] if best is None else crowd.as_traces(best)


def _needed(crowd: Blend, start: FloatArray, alone: BoolArray) -> tuple[JointFit | None, list[int]]:
    """The fit of the spots that the data ask for, and their indices; no fit where there is no sound one.

    All at first, then without the least certain one: to a model that lacks a spot its light is noise, and in
    that noise the others are lost, too. What stands alone is not in question.
    """
    kept = list(range(len(start)))
    while len(kept) > 1:
        full = _settled(crowd.win, start[kept], crowd.noise)
        open_ = [n for n, i in enumerate(kept) if not alone[i]]
        if not open_:
            return (full if _is_sound(full, crowd.win) else None), kept
        weakest = _least_certain(full, start[kept], open_)
        fewer = np.delete(full.params, weakest, axis=0)
        one = fit_joint(crowd.win, fewer, crowd.noise, full.weight)
        if _is_better(one, full, crowd.win, _Asked([weakest], _MIN_SHARE)):
            return full, kept
        del kept[weakest]
    return None, kept


def _least_certain(full: JointFit, start: FloatArray, open_: list[int]) -> int:
    """Of the spots `open_` the one to leave out first.

    Spots of a fit that did not converge tell nothing: most likely two of them are one, the nearest two.
    """
    flux, sd = full.params[:, FLUX], full.sd[:, 0]
    if full.converged:
        told = np.divide(flux, sd, out=np.zeros_like(flux), where=sd > 0)
        return min(open_, key=lambda n: float(told[n]))
    points = start[:, U:LN_SU]
    pairs = [(i, j) for i, j in combinations(range(len(start)), 2) if i in open_ or j in open_]
    nearest = min(pairs, key=lambda pair: float(np.hypot(*(points[pair[0]] - points[pair[1]]))))
    return min((n for n in nearest if n in open_), key=lambda n: float(start[n, FLUX]))


def _halved(start: FloatArray, alone: BoolArray) -> tuple[FloatArray, BoolArray]:
    """First guesses in which longish spots are two, and which of these stand alone."""
    narrowest = start[:, LN_SU:].min()
    long = start[:, LN_SU:].max(axis=1) > narrowest + np.log(_LONGISH)
    pairs = [halves(params) for params in start[long]]
    halved = np.vstack([start[~long], *pairs])
    halved[:, LN_SU:] = narrowest
    return halved, np.append(alone[~long], np.zeros(2 * len(pairs), bool))


def grown(
    scenes: Sequence[PairSignal], group: list[FittedSpot], others: Sequence[FittedSpot]
) -> list[FittedSpot]:
    """A cluster with the neighbours that hide in its residuals, as long as the data ask for them."""
    crowd = Blend(scenes, group, others)
    if not crowd.fits:
        return group
    best = fit_joint(crowd.win, crowd.start_of(group), crowd.noise)
    while len(best.params) < len(group) + _MAX_HIDDEN:
        hidden = hidden_spot(best, crowd.win, crowd.allowed)
        if hidden is None:
            break
        more = _settled(crowd.win, np.vstack([best.params, hidden]), crowd.noise)
        fewer = fit_joint(crowd.win, best.params, crowd.noise, more.weight)
        if not _is_better(fewer, more, crowd.win, _Asked([len(best.params)], _MIN_SHARE)):
            break
        best = more
    return group if len(best.params) == len(group) else crowd.as_traces(best)


def split(scenes: Sequence[PairSignal], trace: FittedSpot, others: list[FittedSpot]) -> list[FittedSpot]:
    """A spot as two if it is elongated and two explain it far better.

    Spots whose light mixes with that of others are left to the fit of all of them together.
    """
    if any(mixes(trace, o) for o in others):
        return [trace]
    crowd = Blend(scenes, [trace], others, 1.3 * trace.reach_px)
    win = crowd.win
    start = trace.params[None].copy()
    start[0, U:LN_SU] -= crowd.col0, crowd.row0
    whole = fit_spots(win, start, crowd.noise)
    usable, changed = without_outliers(win.usable, whole.signal, whole.residual, whole.weight, whole.judged)
    if changed:
        win = win._replace(usable=usable)
        whole = fit_spots(win, start, crowd.noise)
    short, long = principal_axes(whole.params[0])[0]
    if not whole.converged[0] or long < _ELONGATED * short:
        return [trace]
    two = _settled(win, halves(whole.params[0]), crowd.noise)
    one = float(np.vdot(two.weight, whole.residual[0] ** 2))
    if not _is_better(replace(two, chi2=one), two, win, _Asked([0, 1], _MIN_SHARE)):
        return [trace]
    return crowd.as_traces(two)


def _settled(win: Windows, start: FloatArray, noise: PixelNoise) -> JointFit:
    """Fit with the noise that the model itself measures, without pixels that no spot explains."""
    for _ in range(_TURNS):
        joint = fit_joint(win, start, noise)
        signal, residual, weight = joint.signal[None], joint.residual[None], joint.weight[None]
        largest = np.array([[(weight * residual**2).max()]])
        usable, _ = without_outliers(win.usable, signal, residual, weight, largest)
        win, start, noise = win._replace(usable=usable), joint.params, joint.noise
    return fit_joint(win, start, noise)
