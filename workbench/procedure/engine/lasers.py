"""Captures of each laser alone at one placement, and of those that are on together."""

from __future__ import annotations

from workbench.calibration.data.spot_rows import sought
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context


def capture_lasers(context: Context, placement: Placement, repeats: int) -> int:
    """Take `repeats` pairs of frames of each laser alone; returns the number of pairs.

    Lasers of one emitter share their pairs.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
    """
    for together in context.rig.emitters:
        scanlines, _ = sought(context.rig, together[0])
        for repeat in range(repeats):
            for laser in together:
                key = f"{placement.key}/{laser.id}/{repeat:02d}"
                context.capture(key, [laser.id], placement, repeat, scanlines)
    return repeats * len(context.rig.lasers)
