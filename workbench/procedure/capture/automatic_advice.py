"""Text about a camera that adjusts itself, for the step and for the doctor."""

from __future__ import annotations


def automatic_control_advice(darkening: float | None, dimming: float | None) -> str:
    """Finding and what to do; empty without a sign of automatic control.

    Args:
        darkening: relative darkening of the background while a laser is on; None: none.
        dimming: relative dimming of the spot after switching on; None: none.
    """
    if darkening is not None:
        return (
            "The camera adjusts itself: while a laser is on, the rest of the image darkens by"
            f" {100 * darkening:.0f} %. Switch its automatic exposure, gain and white balance off"
        )
    if dimming is not None:
        return (
            f"The spot dims by {100 * dimming:.0f} % after switching on: either the camera adjusts itself"
            " (switch its automatic exposure and gain off), or the laser's power falls (check its supply and"
            " temperature)"
        )
    return ""
