"""Readings of the sensor in a running session, for trials."""

from __future__ import annotations

from collections.abc import Callable

from workbench.model.errors import BadInputError
from workbench.model.event import ReadingTaken
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.spots import Finding


def session_ranger(context: Context, name: str) -> Ranger:
    """Ranger with the session's calibration, for the step `name`.

    Raises:
        BadInputError: there is no calibration.
    """
    if context.calibration is None:
        raise BadInputError(
            f"step {name}: no calibration; run a procedure with an export step before it in the same command,"
            " or name an existing calibration by --calibration FILE"
        )
    return Ranger(context.calibration)


def take_readings(
    context: Context, ranger: Ranger, name: str, placement: Placement, count: int
) -> list[ReadingTaken]:
    """Take `count` readings at a placement, journal each, and return them.

    Args:
        context: session.
        ranger: ranger with the session's calibration.
        name: name of the step, under which the readings are journalled.
        placement: present placement; its key is the prefix of the scenes' names.
        count: number of readings.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
    """
    return [_take_reading(context, ranger, name, placement, number) for number in range(count)]


def _take_reading(
    context: Context, ranger: Ranger, name: str, placement: Placement, number: int
) -> ReadingTaken:
    scene = f"{placement.key}/{number:02d}"
    reading = acquire(ranger, scene, _capture(context, ranger, placement, scene, number))
    stated = placement.standoff_sd_mm
    taken = ReadingTaken(
        trial=name,
        scene=scene,
        standoff_mm=placement.standoff_mm,
        reading=number,
        status=reading.status,
        range_mm=reading.flat_mm,
        sigma_mm=reading.flat_sigma_mm,
        reference_sd_mm=context.rig.bench.placement_sd_mm if stated is None else stated,
        lasers=reading.lasers,
    )
    context.emit(taken)
    return taken


def _capture(
    context: Context, ranger: Ranger, placement: Placement, scene: str, number: int
) -> Callable[[tuple[str, ...]], Finding]:
    """Function that takes a capture of the scene with the given lasers."""

    def capture(ids: tuple[str, ...]) -> Finding:
        alone = len(ids) == 1
        key = f"{scene}/{ids[0] if alone else 'all'}"
        name = f"{scene}/alone" if alone else scene
        return context.capture(key, ids, placement, number, ranger.searched(ids), scene=name)

    return capture
