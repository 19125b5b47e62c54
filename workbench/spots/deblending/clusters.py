"""Which traces are one spot, which disturb each other, and which stand alone."""

from __future__ import annotations

import math
from itertools import combinations, product, starmap

from workbench.spots.kernels.windows import half_for
from workbench.spots.measure import FittedSpot

TAIL_WIDTHS = 2.5
"""The light of a spot beyond so many widths moves no other."""
_SAME_WIDTHS = 0.6
# A spot whose flux is known better than this is no spike of noise; a rival covers it within two widths.
CLEAR_SD = 7.0
_RIVAL_WIDTHS = 2.0


def apart_px(one: FittedSpot, other: FittedSpot) -> float:
    """Distance of two spots."""
    return math.hypot(one.spot.u_px - other.spot.u_px, one.spot.v_px - other.spot.v_px)


def are_apart(traces: list[FittedSpot]) -> bool:
    """Whether no spot is a duplicate of another or disturbs it: the common case, told at once."""
    reach = max((t.reach_px for t in traces), default=0.0)
    limit = half_for(reach) + TAIL_WIDTHS * reach
    places = [(t.spot.u_px, t.spot.v_px) for t in traces]
    return min(starmap(math.dist, combinations(places, 2)), default=limit) >= limit


def without_duplicates(traces: list[FittedSpot]) -> list[FittedSpot]:
    """Peaks whose fits ended on the same spot count once."""
    kept: list[FittedSpot] = []
    for trace in sorted(traces, key=lambda t: -t.spot.flux_dn):
        if all(apart_px(trace, k) > max(_SAME_WIDTHS * min(trace.reach_px, k.reach_px), 0.5) for k in kept):
            kept.append(trace)
    return kept


def clearest(old: list[FittedSpot], new: list[FittedSpot]) -> list[FittedSpot]:
    """Old and new traces; of a faint old one and a new one at the same place only the clearer.

    A narrow fit may have settled on a spike of noise upon a wide faint spot, which is another maximum of the
    likelihood.
    """
    if not old:
        return new
    rivals = [
        (o, n)
        for o, n in product(old, new)
        if o.clarity < CLEAR_SD and apart_px(o, n) < _RIVAL_WIDTHS * max(o.reach_px, n.reach_px)
    ]
    worse = {id(min(pair, key=lambda t: t.clarity)) for pair in rivals}
    return [t for t in (*old, *new) if id(t) not in worse]


def _disturbs(one: FittedSpot, other: FittedSpot) -> bool:
    """Whether light of one spot falls into the window of the other."""
    reach = max(one.reach_px, other.reach_px)
    return apart_px(one, other) < half_for(reach) + TAIL_WIDTHS * reach


def clusters(traces: list[FittedSpot]) -> list[list[FittedSpot]]:
    """Groups of spots that disturb each other, the strongest first in each."""
    groups: list[list[FittedSpot]] = []
    for trace in traces:
        near = [g for g in groups if any(_disturbs(trace, t) for t in g)]
        groups = [g for g in groups if all(g is not n for n in near)]
        groups.append([*(t for g in near for t in g), trace])
    return [sorted(g, key=lambda t: -t.spot.flux_dn) for g in groups]


def mixes(one: FittedSpot, other: FittedSpot) -> bool:
    """Whether light of one spot falls where light of the other does."""
    return apart_px(one, other) < TAIL_WIDTHS * (one.reach_px + other.reach_px)


def stands_alone(trace: FittedSpot, others: list[FittedSpot]) -> bool:
    """Whether a spot is clear, and no light of the others comes where its own is."""
    return trace.clarity >= CLEAR_SD and not any(mixes(trace, o) for o in others)
