"""Captures of each laser alone at one placement."""

from __future__ import annotations

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context


def capture_lasers(context: Context, placement: Placement, repeats: int) -> int:
    """Take `repeats` pairs of frames of each laser alone; returns the number of pairs.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
    """
    for laser in context.rig.lasers:
        scanline = prior_scanline(context.rig, laser)
        for repeat in range(repeats):
            key = f"{placement.key}/{laser.id}/{repeat:02d}"
            context.capture(key, [laser.id], placement, repeat, [scanline])
    return repeats * len(context.rig.lasers)
