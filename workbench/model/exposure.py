"""Target and verdicts for the brightness of the brightest spot, as shares of full scale."""

from __future__ import annotations

from typing import Literal

AIM = 0.65
GOOD = (0.55, 0.7)
"""Lowest and highest share of a good exposure; the rest is headroom for variation between frames."""
CLIPPED = 1.0
WIDEST = 1e7
"""Largest ratio of the longest to the shortest exposure that the search covers."""

Verdict = Literal["unseen", "dim", "good", "bright", "clipped"]


def verdict_of(peak: float, *, seen: bool) -> Verdict:
    """Verdict on a peak, a share of full scale; `unseen` if no laser is seen and the peak is room light."""
    if not seen:
        return "unseen"
    if peak >= CLIPPED:
        return "clipped"
    return "dim" if peak < GOOD[0] else "good" if peak <= GOOD[1] else "bright"
