"""Check a frame with all lasers off for a beam that is on although the controller says that it is off."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from workbench.model.errors import LaserOffNotConfirmedError
from workbench.model.spot import Spot
from workbench.spots.persistence import is_same_spot, persistent_spots


def refuse_stuck_beam(
    what: str,
    lights: Sequence[Spot],
    look_again: Callable[[], Sequence[Spot]],
    latency_advice: str,
    lamps: Sequence[Spot] = (),
) -> list[Spot]:
    """Raise where a frame with all lasers off shows a beam.

    The difference of an on/off pair does not show one that is in both frames. What noise makes of a frame now
    and then does not count, see `persistent_spots`.

    Args:
        what: the capture or reading that the frame belongs to, for the message.
        lights: spots found in the frame.
        look_again: spots found in another such frame; called where a light is faint.
        latency_advice: what to do where the camera's latency was never measured, so that the frame may be an
            old one, exposed while a laser was on; for the message, as the way differs between callers.
        lamps: lights known from before any laser was switched on.

    Returns:
        Those lights that are known.

    Raises:
        LaserOffNotConfirmedError: there is another one.
    """
    known = [light for light in lights if any(is_same_spot(light, lamp) for lamp in lamps)]
    stuck = persistent_spots([light for light in lights if light not in known], look_again)
    if stuck:
        raise LaserOffNotConfirmedError(
            f"{what}: the frame with all lasers off shows a spot at {position_text(stuck[0])}. A beam may be"
            " on although the controller says that it is off: cut the lasers' supply, keep out of the beams,"
            " then check the controller. If a lamp or its reflection stands there, cover it and start anew;"
            f" if the camera's latency was never measured, the frame may be an old one: {latency_advice}"
        )
    return known


def position_text(light: Spot) -> str:
    """Position of a light in whole pixels, for messages."""
    return f"u = {light.u_px:.0f}, v = {light.v_px:.0f} px"
