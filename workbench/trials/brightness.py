"""Exposure that follows the brightness of the spots from one capture to the next."""

from __future__ import annotations

from workbench.model.exposure import AIM
from workbench.procedure.engine.context import Context

LARGEST_CHANGE = 8.0
"""Largest ratio of the exposures of two captures."""
SPOTLESS_CHANGE = 2.0
"""Ratio of the exposures after a capture without a spot."""


def follow_brightness(context: Context) -> None:
    """Scale the exposure by the brightest spot of the last capture, as an automatic exposure would.

    Raises:
        RigNotReadyError: the camera does not accept the exposure.
    """
    last = context.captures[-1]
    if last.exposure is None:
        return
    spots = context.findings[last.key].spots
    aim_dn = AIM * (2**context.rig.camera.bits - 1)
    factor = SPOTLESS_CHANGE if not spots else aim_dn / max(spot.peak_dn for spot in spots)
    context.pairs.change_exposure(
        float(f"{last.exposure * min(max(factor, 1 / LARGEST_CHANGE), LARGEST_CHANGE):.3g}")
    )
