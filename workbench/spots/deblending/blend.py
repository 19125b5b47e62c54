"""Deblending: joint fits of overlapping spots, splitting and adding spots by an F test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.spot import Failure, Spot
from workbench.spots.deblending.clusters import TAIL_WIDTHS, is_isolated, overlap
from workbench.spots.deblending.joint_fit import JointFit, f_statistic, fit_joint, hidden_spot, pair_guess
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.acceptance import without_outliers
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR, U
from workbench.spots.kernels.windows import exclude_light, half_for, mark_strip
from workbench.spots.measure import FittedSpot, spot_flags
from workbench.spots.noise import PixelNoise
from workbench.spots.pair import PairSignal
from workbench.spots.psf import principal_axes

# F statistic (3 parameters) that an added spot must reach; of noise in some hundred pixels, once in 1e5.
_MIN_F = 10.0
# Closer than this, in widths, the centres of two spots are correlated: flag `merged`.
_OVERLAP_WIDTHS = 4.0
_MIN_SEPARATION_WIDTHS = 1.0
# Lowest flux of an added spot: as a share of the strongest, and in its standard deviations.
_MIN_SHARE = 0.08
_MIN_FLUX_SD = 5.0
# Axis ratio from which a spot alone, and a member of a cluster, is tried as two.
_ELONGATED = 1.12
_ELONGATED_IN_CLUSTER = 1.3
_MAX_HALF_PX = 120
_MAX_HIDDEN = 4
# Fits before the last one, each with the noise and the outliers of the one before.
_ROUNDS = 2
_NO_MASK = np.zeros((0, 0), bool)
_ONLY = np.array([0])


class Blend:
    """Cluster of spots, and the window that they are fitted in.

    Args:
        scenes: Strips that are searched; pixels outside all of them are not fitted.
        group: Spots of the cluster, at least one.
        others: All other spots; pixels with their light are not used.
        reach_px: Width that the window is sized for; None: that of the widest spot.
    """

    def __init__(
        self,
        scenes: Sequence[PairSignal],
        group: Sequence[FittedSpot],
        others: Sequence[FittedSpot],
        reach_px: float | None = None,
    ) -> None:
        self.scene = group[0].scene
        # Start values: the lowest that were measured, since a misfit only raises them.
        slope, contrast2 = min(t.slope_dn for t in group), min(t.contrast2 for t in group)
        self.noise = PixelNoise(
            np.array([self.scene.variance]),
            np.array([slope]),
            np.array([contrast2]),
            self.scene.pair.stated_contrast2,
        )
        reach = reach_px or max(t.reach_px for t in group)
        u, v = [t.spot.u_px for t in group], [t.spot.v_px for t in group]
        extent = max(max(u) - min(u), max(v) - min(v))
        half = half_for(reach) + math.ceil(0.5 * extent)
        self.is_within_limit = half <= _MAX_HALF_PX
        half = min(half, _MAX_HALF_PX)
        row, col = round(0.5 * (min(v) + max(v))), round(0.5 * (min(u) + max(u)))
        self.row0, self.col0 = row - half, col - half
        self.win = self.scene.pair.cut(np.array([float(row)]), np.array([float(col)]), _ONLY, half)
        """(1, height, width): window around all spots of the cluster."""
        self.allowed: BoolArray = self._in_a_strip(scenes)
        # Light off the scanline does not come from spots on it.
        lights = [(t.spot.u_px, t.spot.v_px, TAIL_WIDTHS * t.reach_px) for t in others]
        discs = np.array(lights).reshape(-1, 3)
        near = math.ceil(TAIL_WIDTHS * reach)
        exclude_light(self.row0, self.col0, discs, near, self.allowed, self.win.usable[0])

    def start_of(self, fits: Sequence[FittedSpot]) -> FloatArray:
        """(n, 6) parameters of fitted spots, in pixels of the window."""
        return np.array([t.params[:SHEAR] for t in fits]) - (0, 0, self.col0, self.row0, 0, 0)

    def as_fitted_spots(self, joint: JointFit) -> list[FittedSpot]:
        """Spots of a joint fit, in pixels of the image."""
        absolute = joint.params + np.array([0, 0, self.col0, self.row0, 0, 0])
        fits = []
        rows, centres = absolute.tolist(), absolute[:, U:LN_SU].tolist()
        slope, contrast2 = joint.noise.slope_dn.item(), joint.noise.contrast2.item()
        own = zip(rows, joint.sd.tolist(), joint.speckle_sd.tolist(), strict=True)
        all_flags = spot_flags(self.scene, absolute)
        for i, ((_, flux, u, v, ln_su, ln_sv), sd, speckle_sd) in enumerate(own):
            reach, flags = math.exp(max(ln_su, ln_sv)), all_flags[i]
            others = (*centres[:i], *centres[i + 1 :])
            if any(math.dist((u, v), other) < _OVERLAP_WIDTHS * reach for other in others):
                flags |= {Failure.MERGED}
            width = math.exp(0.5 * (ln_su + ln_sv))
            peak = flux / (2.0 * math.pi * (width**2 + 1.0 / 12.0))
            spot = Spot(
                u_px=u,
                v_px=v,
                u_sd_px=sd[1],
                v_sd_px=sd[2],
                flux_dn=flux,
                width_px=width,
                peak_dn=peak,
                flags=flags,
                u_speckle_sd_px=speckle_sd[0],
                v_speckle_sd_px=speckle_sd[1],
            )
            fits.append(FittedSpot(spot, absolute[i], slope, contrast2, reach, flux / sd[0], self.scene))
        return fits

    def _in_a_strip(self, scenes: Sequence[PairSignal]) -> BoolArray:
        """(height, width): pixels where a scanline allows a spot."""
        found = np.zeros(self.win.shape, bool)
        for strip in (scene.strip for scene in scenes):
            rows, cols = (strip.rows.start, strip.rows.stop), (strip.cols.start, strip.cols.stop)
            mask = _NO_MASK if strip.mask is None else strip.mask
            mark_strip(self.row0, self.col0, rows, cols, mask, found)
        return found


class _Candidates(NamedTuple):
    """Spots that one fit has and the other lacks, and the least flux as a share of the strongest spot's."""

    indices: list[int]
    min_share: float


def _is_significant(one: JointFit, two: JointFit, win: Windows, candidates: _Candidates) -> bool:
    """Whether the candidates, which `two` has and `one` lacks, are significant (F test).

    `one` was fitted with the weights of `two`.
    """
    flux, points = two.params[:, FLUX], two.params[:, U:LN_SU]
    reach = float(np.exp(two.params[0, LN_SU:SHEAR].max()))
    separation = min(
        float(np.hypot(*(points[i] - points[j])))
        for i, j in combinations(range(len(points)), 2)
        if i in candidates.indices or j in candidates.indices
    )
    return (
        _is_sound(two, win)
        and separation > _MIN_SEPARATION_WIDTHS * reach
        and float(flux[candidates.indices].min()) > candidates.min_share * float(flux.max())
        and bool((flux > _MIN_FLUX_SD * two.sd[:, 0])[candidates.indices].all())
        and f_statistic(one.chi2, two.chi2, int((two.weight > 0).sum()), 3 + 3 * len(flux)) > _MIN_F
    )


def _is_sound(joint: JointFit, win: Windows) -> bool:
    """Whether a fit converged with all centres inside the window."""
    points = joint.params[:, U:LN_SU]
    return joint.converged and bool((points >= 0).all() and (points < np.array(win.shape[::-1])).all())


def fit_blends(
    scenes: Sequence[PairSignal], group: list[FittedSpot], others: Sequence[FittedSpot], wants_more: bool
) -> list[FittedSpot]:
    """Joint fit of a cluster, strongest spot first; spots that are not significant are dropped.

    While spots are missing, elongated members are tried as two.
    """
    if len(group) == 1:
        return group
    blend = Blend(scenes, group, others)
    if not blend.is_within_limit:
        return group
    start = blend.start_of(group)
    alone = np.array([is_isolated(t, [o for o in group if o is not t]) for t in group])
    if wants_more:
        best, _ = _significant_spots(blend, *_elongated_as_pairs(start, alone))
        if best is not None and len(best.params) > len(start):
            return blend.as_fitted_spots(best)
    best, kept = _significant_spots(blend, start, alone)
    return [group[i] for i in kept] if best is None else blend.as_fitted_spots(best)


def _significant_spots(
    blend: Blend, start: FloatArray, alone: BoolArray
) -> tuple[JointFit | None, list[int]]:
    """Fit of the significant spots, and their indices; None where no fit is sound.

    Backward elimination: all spots at first, then without the least significant one. In a model that lacks a
    spot, its light counts as noise and hides the others. Isolated spots are never dropped.
    """
    kept = list(range(len(start)))
    while len(kept) > 1:
        full = _fit_without_outliers(blend.win, start[kept], blend.noise)
        removable = [n for n, i in enumerate(kept) if not alone[i]]
        if not removable:
            return (full if _is_sound(full, blend.win) else None), kept
        weakest = _least_significant(full, start[kept], removable)
        fewer = np.delete(full.params, weakest, axis=0)
        one = fit_joint(blend.win, fewer, blend.noise, full.weight)
        if _is_significant(one, full, blend.win, _Candidates([weakest], _MIN_SHARE)):
            return full, kept
        del kept[weakest]
    return None, kept


def _least_significant(full: JointFit, start: FloatArray, removable: list[int]) -> int:
    """Index of the spot, among `removable`, to drop first.

    A fit that did not converge gives no ranking: most likely its closest two spots are one.
    """
    flux, sd = full.params[:, FLUX], full.sd[:, 0]
    if full.converged:
        snr = np.divide(flux, sd, out=np.zeros_like(flux), where=sd > 0)
        return min(removable, key=lambda n: float(snr[n]))
    points = start[:, U:LN_SU]
    pairs = [(i, j) for i, j in combinations(range(len(start)), 2) if i in removable or j in removable]
    nearest = min(pairs, key=lambda pair: float(np.hypot(*(points[pair[0]] - points[pair[1]]))))
    return min((n for n in nearest if n in removable), key=lambda n: float(start[n, FLUX]))


def _elongated_as_pairs(start: FloatArray, alone: BoolArray) -> tuple[FloatArray, BoolArray]:
    """First guesses with each elongated spot as two, (n, 6), and which of them are isolated, (n,)."""
    narrowest = start[:, LN_SU:].min()
    long = start[:, LN_SU:].max(axis=1) > narrowest + np.log(_ELONGATED_IN_CLUSTER)
    pairs = [pair_guess(params) for params in start[long]]
    halved = np.vstack([start[~long], *pairs])
    halved[:, LN_SU:] = narrowest
    return halved, np.append(alone[~long], np.zeros(2 * len(pairs), bool))


def with_hidden_spots(
    scenes: Sequence[PairSignal], group: list[FittedSpot], others: Sequence[FittedSpot]
) -> list[FittedSpot]:
    """A cluster with spots added from its residuals, while they are significant."""
    blend = Blend(scenes, group, others)
    if not blend.is_within_limit:
        return group
    best = fit_joint(blend.win, blend.start_of(group), blend.noise)
    while len(best.params) < len(group) + _MAX_HIDDEN:
        hidden = hidden_spot(best, blend.allowed)
        if hidden is None:
            break
        more = _fit_without_outliers(blend.win, np.vstack([best.params, hidden]), blend.noise)
        fewer = fit_joint(blend.win, best.params, blend.noise, more.weight)
        if not _is_significant(fewer, more, blend.win, _Candidates([len(best.params)], _MIN_SHARE)):
            break
        best = more
    return group if len(best.params) == len(group) else blend.as_fitted_spots(best)


def split_elongated(
    scenes: Sequence[PairSignal], fit: FittedSpot, others: list[FittedSpot]
) -> list[FittedSpot]:
    """An elongated spot as two, where the second one is significant.

    A spot that overlaps others is left to the joint fit of its cluster.
    """
    if any(overlap(fit, o) for o in others):
        return [fit]
    blend = Blend(scenes, [fit], others, 1.3 * fit.reach_px)
    win = blend.win
    start = fit.params[None].copy()
    start[0, U:LN_SU] -= blend.col0, blend.row0
    whole = fit_spots(win, start, blend.noise)
    usable, changed = without_outliers(
        win.usable, whole.signal, whole.residual, whole.weight, whole.statistics
    )
    if changed:
        win = win._replace(usable=usable)
        whole = fit_spots(win, start, blend.noise)
    short, long = principal_axes(whole.params[0])[0]
    if not whole.converged[0] or long < _ELONGATED * short:
        return [fit]
    two = _fit_without_outliers(win, pair_guess(whole.params[0]), blend.noise)
    one = float(np.vdot(two.weight, whole.residual[0] ** 2))
    if not _is_significant(replace(two, chi2=one), two, win, _Candidates([0, 1], _MIN_SHARE)):
        return [fit]
    return blend.as_fitted_spots(two)


def _fit_without_outliers(win: Windows, start: FloatArray, noise: PixelNoise) -> JointFit:
    """Joint fit with the noise measured from its own residuals, and without outlying pixels."""
    assumed = noise
    for _ in range(_ROUNDS):
        joint = fit_joint(win, start, noise, assumed=assumed)
        signal, residual, weight = joint.signal[None], joint.residual[None], joint.weight[None]
        largest = np.array([[(weight * residual**2).max()]])
        usable, _ = without_outliers(win.usable, signal, residual, weight, largest)
        win, start, noise = win._replace(usable=usable), joint.params, joint.noise
    return fit_joint(win, start, noise, assumed=assumed)
