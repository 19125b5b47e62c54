"""What a fit is told of a running session's captures."""

from __future__ import annotations

from math import nan

from workbench.calibration.data.observations import Observation, Rejected
from workbench.calibration.data.spot_rows import observe
from workbench.model import event as ev
from workbench.model.captures import BOARD
from workbench.procedure.engine.context import Context


def observe_capture(context: Context, capture: ev.CaptureTaken) -> Observation | Rejected:
    """The one spot of a capture of a laser alone, or why there is none."""
    laser = context.rig.lasers[context.rig.laser_ids.index(capture.laser_id)]
    observation = Observation(
        source=capture.on.path,
        laser_id=capture.laser_id,
        placement=capture.placement_key,
        standoff_mm=capture.standoff_mm,
        repeat=capture.repeat,
        u_px=nan,
        v_px=nan,
        standoff_sd_mm=nan if capture.standoff_sd_mm is None else capture.standoff_sd_mm,
    )
    return observe(context.findings[capture.key], laser, observation)


def observed_so_far(context: Context) -> list[Observation]:
    """Every spot of the calibration seen so far on a flat target, not on the board."""
    found = [
        observe_capture(context, capture)
        for capture in context.captures
        if capture.purpose == "calibration"
        and capture.laser_id != BOARD
        and capture.placement_key not in context.boards
    ]
    return [f for f in found if isinstance(f, Observation)]
