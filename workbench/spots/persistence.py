"""Lights in a frame that should be dark: told from what noise makes of a frame once in some hundred."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot

from workbench.model.spot import Spot

CLEAR = 10.0
"""Width of a light over the deviation of its place, which is its brightness over that one's deviation. Noise
reached 7.3 in 1600 whole frames."""
SAME_LIGHT_PX = 3.0
SAME_LIGHT_SD = 4.0
"""Lights of two frames that lie so near to each other are the same."""


def is_same_spot(light: Spot, other: Spot) -> bool:
    """Whether the lights of two frames are one."""
    sd = hypot(light.u_sd_px, light.v_sd_px, other.u_sd_px, other.v_sd_px)
    away = hypot(light.u_px - other.u_px, light.v_px - other.v_px)
    return away < SAME_LIGHT_PX + SAME_LIGHT_SD * sd


def clearness(light: Spot) -> float:
    """How many of its standard deviations a light is bright, see `CLEAR`."""
    return light.width_px / min(light.u_sd_px, light.v_sd_px)


def persistent_spots(lights: Sequence[Spot], look_again: Callable[[], Sequence[Spot]]) -> list[Spot]:
    """The lights that are no noise: clear, or there in another frame as well.

    Args:
        lights: what was found in a frame that should be dark.
        look_again: what is found in another such frame; called where a light is faint.
    """
    faint = [light for light in lights if clearness(light) <= CLEAR]
    if not faint:
        return list(lights)
    again = look_again()
    return [
        light for light in lights if light not in faint or any(is_same_spot(light, other) for other in again)
    ]
