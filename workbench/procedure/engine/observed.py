"""Observations of a running session, and the expected position of a missing spot."""

from __future__ import annotations

from math import nan

from workbench.calibration.data.observations import Observation
from workbench.calibration.data.spot_rows import observe
from workbench.calibration.design.expected_spot import ExpectedSpot, expected_spot
from workbench.model import event as ev
from workbench.model.captures import BOARD
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.session.capture_table import part_name, seconds_after


def observe_capture(context: Context, capture: ev.CaptureTaken, zero_ns: int = 0) -> Observation | Rejected:
    """Observation from a capture of one laser, or the reason why there is none.

    Args:
        context: session.
        capture: the capture.
        zero_ns: zero of the observation's time, as in the captures file.
    """
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
        time_s=seconds_after(zero_ns, capture),
        part=part_name(capture),
    )
    return observe(context.findings[capture.key], laser, observation)


def observed_so_far(context: Context) -> list[Observation]:
    """Observations of the calibration so far on a flat target (not on the board)."""
    found = [
        observe_capture(context, capture)
        for capture in context.captures
        if capture.purpose == "calibration"
        and capture.laser_id != BOARD
        and capture.placement_key not in context.boards
    ]
    return [f for f in found if isinstance(f, Observation)]


def expected_position_text(context: Context, laser_id: str, placement: Placement) -> str:
    """Expected position of a spot on a square flat target, from the rig file and the observations so far."""
    where = expected_spot(context.rig, observed_so_far(context), laser_id, placement.standoff_mm)
    return expected_spot_text(context.rig, laser_id, where)


def expected_spot_text(rig: Rig, laser_id: str, where: ExpectedSpot) -> str:
    """Text of an expected position, with advice for the person at the bench."""
    image = f"the image of {rig.camera.width_px} x {rig.camera.height_px} pixels"
    advice = {
        "outside": f"outside {image}: {laser_id} cannot be seen at this standoff.",
        "at the edge": f"at the edge of {image}: {laser_id} may not be visible at this standoff.",
        "inside": f"inside {image}: check that {laser_id} is on and that its beam hits the target.",
    }
    return (
        f"Its spot is expected at u = {where.u_px:.0f} +- {where.u_sd_px:.0f},"
        f" v = {where.v_px:.0f} +- {where.v_sd_px:.0f} px (1 sigma), {advice[where.place]}"
    )
