"""Lights in a frame that should be dark: told from what noise makes of a frame once in some hundred."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot

from workbench.spots.types import Spot

CLEAR = 10.0
"""A place that is known to a tenth of the spot's width: with it goes a light of ten standard deviations, and
noise does not reach that. A search of all of a picture has some 10^5 places in which it may reach four."""
SAME_LIGHT_PX = 3.0
"""Lights of two frames that lie so near to each other are the same."""


def is_same(light: Spot, other: Spot) -> bool:
    """Whether the lights of two frames are one."""
    return hypot(light.u_px - other.u_px, light.v_px - other.v_px) < SAME_LIGHT_PX


def lasting(lights: Sequence[Spot], look_again: Callable[[], Sequence[Spot]]) -> list[Spot]:
    """The lights that are no noise: clear, or there in another frame as well.

    Args:
        lights: what was found in a frame that should be dark.
        look_again: what is found in another such frame; called where a light is faint and none is clear.
    """
    clear = [light for light in lights if light.width_px > CLEAR * min(light.u_sd_px, light.v_sd_px)]
    if clear or not lights:
        return clear
    again = look_again()
    return [light for light in lights if any(is_same(light, other) for other in again)]
