"""A laser without a spot, in words: where the spot should be, and so whether anything is wrong."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.calibration.design.expected_spot import ExpectedSpot, expected_spot
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.observed import observed_so_far


def why_not_measured(quantity: str, laser_id: str, spots: Sequence[int]) -> str:
    """Why a quantity could not be measured, where each capture of a laser shows so many `spots`."""
    captures = "1 capture" if len(spots) == 1 else f"{len(spots)} captures"
    if 1 in spots:
        return f"{quantity} takes a spot of {laser_id} in two captures or more"
    if any(spots):
        return f"{laser_id} cannot be told among up to {max(spots)} spots in {captures}"
    return f"no spot of {laser_id} was found in {captures}"


def expected_position_text(context: Context, laser_id: str, placement: Placement) -> str:
    """By the rig file and by what was seen so far, of a square flat target; what that means."""
    where = expected_spot(context.rig, observed_so_far(context), laser_id, placement.standoff_mm)
    return in_words(context.rig, laser_id, where)


def in_words(rig: Rig, laser_id: str, where: ExpectedSpot) -> str:
    """For the person at the bench."""
    picture = f"the picture of {rig.camera.width_px} x {rig.camera.height_px}"
    told = {
        "outside": f"outside {picture}: {laser_id} cannot be seen here, and nothing is wrong.",
        "at the edge": f"at the edge of {picture}: if it is outside, nothing is wrong.",
        "inside": f"inside {picture}: is {laser_id} lit, and does its beam reach the target?",
    }
    return (
        f"By what is known so far, its spot is at u = {where.u_px:.0f} +- {where.u_sd_px:.0f},"
        f" v = {where.v_px:.0f} +- {where.v_sd_px:.0f} px (1 sigma), {told[where.place]}"
    )
