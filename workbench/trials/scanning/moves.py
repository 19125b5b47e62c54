"""Moves of a scanning head at one placement of the target, with the captures at each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.calibration.data.observations import Observation
from workbench.calibration.data.spot_rows import prior_scanline
from workbench.model.errors import BadInputError, RigNotReadyError
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.observed import observe_capture
from workbench.trials.brightness import follow_brightness


@dataclass(frozen=True)
class HeadCapture:
    """Result of one capture: the spot, or the reason why there is none."""

    reading_deg: float
    found: Observation | Rejected


def check_reach(rig: Rig, angles_deg: Sequence[float]) -> None:
    """Check that the head of a rig reaches all angles.

    Raises:
        BadInputError: the rig has no head, or it does not reach an angle.
    """
    low, high = rig.scanning_head.reach_deg
    if wrong := [angle for angle in angles_deg if not low <= angle <= high]:
        raise BadInputError(
            f"rig {rig.rig}: the head reaches {low:g} to {high:g} deg, got {wrong[0]:g} deg; change the"
            " angles of the procedure, or head.reach_deg"
        )


def sweep(
    context: Context, placed: Placement, angles_deg: Sequence[float], repeats: int
) -> list[HeadCapture]:
    """Turn the head to each angle and capture its laser `repeats` times.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
        RigNotReadyError: a device does not answer.
    """
    laser = context.rig.head_laser
    found = []
    for number, angle_deg in enumerate(angles_deg):
        scene = f"{placed.key}/{number:03d}"
        at = _turned(context, placed, angle_deg, f"{scene}/00")
        if at.head_deg is None:
            raise RigNotReadyError(
                f"placement {placed.key}: expected the reading of the head's encoder from the target's"
                " driver, got none; its `place` must return head_deg"
            )
        scanline = prior_scanline(context.rig, laser, at.head_deg)
        for repeat in range(repeats):
            context.capture(f"{scene}/{repeat:02d}", [laser.id], at, repeat, [scanline], scene)
            taken = context.captures[-1]
            found.append(HeadCapture(at.head_deg, observe_capture(context, taken)))
        # A beam beyond the image or beside the target gives no spot: the target is as bright as before.
        if context.findings[taken.key].spots:
            follow_brightness(context)
    return found


def _turned(context: Context, placed: Placement, angle_deg: float, key: str) -> Placement:
    """Turn the head; a placement that is replayed from disk has the reading of its capture `key`."""
    wanted = placed.model_copy(update={"head_deg": angle_deg})
    if context.pairs.replayed is None:
        return context.bench.target.place(wanted)
    kept = context.pairs.replayed.captures.get(key)
    return wanted if kept is None else wanted.model_copy(update={"head_deg": kept.head_deg})
