"""Duplicates, clusters and isolated spots among the fitted spots of a frame."""

from __future__ import annotations

import math
from itertools import combinations, product, starmap

from workbench.spots.kernels.windows import half_for
from workbench.spots.measure import FittedSpot

TAIL_WIDTHS = 2.5
"""Radius of a spot in widths; its light beyond does not shift the fit of another spot."""
_SAME_WIDTHS = 0.6
# Signal-to-noise ratio of the flux above which a spot is no spike of noise; below, a rival within two
# widths may replace the spot.
CLEAR_SNR = 7.0
_RIVAL_WIDTHS = 2.0


def separation_px(one: FittedSpot, other: FittedSpot) -> float:
    """Distance between the centres of two spots."""
    return math.hypot(one.spot.u_px - other.spot.u_px, one.spot.v_px - other.spot.v_px)


def are_separate(fits: list[FittedSpot]) -> bool:
    """Whether no spot's light reaches the window of another: a quick test for the common case."""
    reach = max((t.reach_px for t in fits), default=0.0)
    limit = half_for(reach) + TAIL_WIDTHS * reach
    centres = [(t.spot.u_px, t.spot.v_px) for t in fits]
    return min(starmap(math.dist, combinations(centres, 2)), default=limit) >= limit


def without_duplicates(fits: list[FittedSpot]) -> list[FittedSpot]:
    """Fits without those that converged on the same spot as a brighter one; brightest first."""
    kept: list[FittedSpot] = []
    for fit in sorted(fits, key=lambda t: -t.spot.flux_dn):
        if all(separation_px(fit, k) > max(_SAME_WIDTHS * min(fit.reach_px, k.reach_px), 0.5) for k in kept):
            kept.append(fit)
    return kept


def without_rivals(old: list[FittedSpot], new: list[FittedSpot]) -> list[FittedSpot]:
    """Old and new fits; of a faint old one and a new one at its position only that of higher flux SNR.

    A narrow fit may have converged on a noise spike within a faint wide spot: a local maximum of the
    likelihood.
    """
    if not old:
        return new
    rivals = [
        (o, n)
        for o, n in product(old, new)
        if o.flux_snr < CLEAR_SNR and separation_px(o, n) < _RIVAL_WIDTHS * max(o.reach_px, n.reach_px)
    ]
    worse = {id(min(pair, key=lambda t: t.flux_snr)) for pair in rivals}
    return [t for t in (*old, *new) if id(t) not in worse]


def _reaches_window(one: FittedSpot, other: FittedSpot) -> bool:
    """Whether light of one spot reaches the window of the other."""
    reach = max(one.reach_px, other.reach_px)
    return separation_px(one, other) < half_for(reach) + TAIL_WIDTHS * reach


def clusters(fits: list[FittedSpot]) -> list[list[FittedSpot]]:
    """Groups of spots that are linked by light in each other's windows, strongest first in each."""
    groups: list[list[FittedSpot]] = []
    for fit in fits:
        near = [g for g in groups if any(_reaches_window(fit, t) for t in g)]
        groups = [g for g in groups if all(g is not n for n in near)]
        groups.append([*(t for g in near for t in g), fit])
    return [sorted(g, key=lambda t: -t.spot.flux_dn) for g in groups]


def overlap(one: FittedSpot, other: FittedSpot) -> bool:
    """Whether the images of two spots overlap within `TAIL_WIDTHS`."""
    return separation_px(one, other) < TAIL_WIDTHS * (one.reach_px + other.reach_px)


def is_isolated(fit: FittedSpot, others: list[FittedSpot]) -> bool:
    """Whether a spot is significant and overlaps no other."""
    return fit.flux_snr >= CLEAR_SNR and not any(overlap(fit, o) for o in others)
