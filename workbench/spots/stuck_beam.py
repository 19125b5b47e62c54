"""Check of a frame with all lasers off for a stuck beam: on although the controller reports it off."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from workbench.model.errors import LaserOffNotConfirmedError
from workbench.model.spot import Spot
from workbench.spots.persistence import is_same_spot, persistent_spots


def refuse_stuck_beam(
    what: str,
    spots: Sequence[Spot],
    find_again: Callable[[], Sequence[Spot]],
    latency_advice: str,
    lamps: Sequence[Spot] = (),
) -> list[Spot]:
    """Raise where a frame with all lasers off shows a beam.

    The difference of an on/off pair hides a beam that is in both frames. Spots must be confirmed, since noise
    passes for a spot now and then (`persistent_spots`).

    Args:
        what: Capture or reading that the frame belongs to, for the message.
        spots: Spots found in the frame.
        find_again: Finds the spots of another such frame; called only where a spot is faint.
        latency_advice: Remedy for a camera latency that was never measured, for the message. The frame may
            then be an old one, exposed while a laser was on.
        lamps: Spots that were present before any laser was switched on.

    Returns:
        Spots that are lamps.

    Raises:
        LaserOffNotConfirmedError: a spot is not a lamp, and is confirmed.
    """
    known = [spot for spot in spots if any(is_same_spot(spot, lamp) for lamp in lamps)]
    stuck = persistent_spots([spot for spot in spots if spot not in known], find_again)
    if stuck:
        raise LaserOffNotConfirmedError(
            f"{what}: the frame with all lasers off shows a spot at {position_text(stuck[0])}. A beam may be"
            " on although the controller reports it off: cut the lasers' supply, keep out of the beams, then"
            " check the controller. If it is a lamp or its reflection, cover it and start again; if the"
            f" camera's latency was never measured, the frame may be an old one: {latency_advice}"
        )
    return known


def position_text(spot: Spot) -> str:
    """Position of a spot in whole pixels, for messages."""
    return f"u = {spot.u_px:.0f}, v = {spot.v_px:.0f} px"
