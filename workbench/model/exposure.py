"""How bright the brightest spot is to be, and what it is called: shares of full scale, in one place."""

from __future__ import annotations

from typing import Literal

AIM = 0.65
GOOD = (0.55, 0.7)
"""A quarter of the range and more is left for what differs from frame to frame."""
CLIPPED = 1.0
WIDEST = 1e7
"""Longest by shortest exposure that the search gets through."""

Verdict = Literal["unseen", "dim", "good", "bright", "clipped"]


def verdict_of(peak: float, *, seen: bool) -> Verdict:
    """What a share of full scale is called; where no laser is seen it is the room's, and never good."""
    if not seen:
        return "unseen"
    if peak >= CLIPPED:
        return "clipped"
    return "dim" if peak < GOOD[0] else "good" if peak <= GOOD[1] else "bright"
