"""Readings of the sensor in a running session, as trials take them."""

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
    """The ranger of the session's calibration, for the step `name`.

    Raises:
        BadInputError: no calibration was exported.
    """
    if context.calibration is None:
        raise BadInputError(
            f"step {name}: no calibration to range with; run a procedure with an export step before it,"
            " in the same call"
        )
    return Ranger(context.calibration)


def take_readings(
    context: Context, ranger: Ranger, name: str, placement: Placement, count: int
) -> list[ReadingTaken]:
    """Take `count` readings at a placement, journal each, and return them.

    Args:
        context: the session.
        ranger: ranges the spots.
        name: of the step, under which the readings are journalled.
        placement: where the target stands; its key begins the names of the scenes.
        count: number of readings.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
    """
    return [_take_reading(context, ranger, name, placement, number) for number in range(count)]


def _take_reading(
    context: Context, ranger: Ranger, name: str, placement: Placement, number: int
) -> ReadingTaken:
    scene = f"{placement.key}/{number:02d}"
    reading = acquire(ranger, scene, _shoot(context, ranger, placement, scene, number))
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


def _shoot(
    context: Context, ranger: Ranger, placement: Placement, scene: str, number: int
) -> Callable[[tuple[str, ...]], Finding]:
    """Capture with the given lasers lit, under the scene's name."""

    def shoot(ids: tuple[str, ...]) -> Finding:
        alone = len(ids) == 1
        key = f"{scene}/{ids[0] if alone else 'all'}"
        shown = f"{scene}/alone" if alone else scene
        return context.capture(key, ids, placement, number, ranger.searched(ids), scene=shown)

    return shoot
