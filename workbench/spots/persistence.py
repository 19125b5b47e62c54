"""Confirmation of spots in a frame with all lasers off.

In one of some hundred such frames, a noise peak passes for a spot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot

from workbench.model.spot import Spot

SIGNIFICANT = 10.0
"""Significance above which a spot needs no second frame. Noise reached 7.3 in 1600 whole frames."""
SAME_SPOT_PX = 3.0
SAME_SPOT_SD = 4.0
"""Largest distance of one spot in two frames: a margin in px, plus a multiple of its standard deviation."""


def is_same_spot(spot: Spot, other: Spot) -> bool:
    """Whether spots of two frames are the same one."""
    sd = hypot(spot.u_sd_px, spot.v_sd_px, other.u_sd_px, other.v_sd_px)
    distance = hypot(spot.u_px - other.u_px, spot.v_px - other.v_px)
    return distance < SAME_SPOT_PX + SAME_SPOT_SD * sd


def significance(spot: Spot) -> float:
    """Width over the standard deviation of the position, which is about the flux over that of the flux.

    Speckle counts, since a misfit to what is no spot looks like it.
    """
    u_sd_px = hypot(spot.u_sd_px, spot.u_speckle_sd_px or 0.0)
    v_sd_px = hypot(spot.v_sd_px, spot.v_speckle_sd_px or 0.0)
    return spot.width_px / min(u_sd_px, v_sd_px)


def persistent_spots(spots: Sequence[Spot], find_again: Callable[[], Sequence[Spot]]) -> list[Spot]:
    """Spots that are not noise: significant, or present in a second frame.

    Args:
        spots: Spots of a frame with all lasers off.
        find_again: Finds the spots of another such frame; called only where a spot is faint.
    """
    faint = [spot for spot in spots if significance(spot) <= SIGNIFICANT]
    if not faint:
        return list(spots)
    again = find_again()
    return [spot for spot in spots if spot not in faint or any(is_same_spot(spot, other) for other in again)]
