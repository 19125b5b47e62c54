"""Readings of the sensor in a running session, for trials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, isfinite

from workbench.model.errors import BadInputError
from workbench.model.event import ReadingTaken, TrueValues
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.optics.rows import Row
from workbench.procedure.engine.context import Context
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.ranging.shape import Shape
from workbench.sensor.calibrated import CalibratedSensor
from workbench.spots import Finding
from workbench.trials.reference import Reference
from workbench.trials.targets import TargetSpec, front_row, true_values


@dataclass(frozen=True)
class ClosestRange:
    """Readings of the closest range over the front, instead of the range of a flat across the axis."""

    true: TrueValues
    front_mm: tuple[float, float]
    """Ends of the front."""
    row: Row | None = None
    """Row of lasers whose shape gives angle and radius."""
    left_off: tuple[str, ...] = ()
    """Lasers that stay off as if they had failed."""
    blocked: tuple[str, ...] = ()
    """Lasers whose beams are blocked before the target."""

    @classmethod
    def of(cls, target: TargetSpec, placed: Placement, sensor: CalibratedSensor, rig: Rig) -> ClosestRange:
        """Readings of a target at a placement as measured."""
        row = front_row(target, sensor)
        front = (0.0, 0.0) if row is None else sensor.front_mm(row, placed.standoff_mm)
        return cls(true_values(target, placed, sensor, rig), front, row)


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
    context: Context,
    ranger: Ranger,
    name: str,
    placement: Placement,
    count: int,
    closest: ClosestRange | None = None,
) -> list[ReadingTaken]:
    """Take `count` readings at a placement, journal each, and return them.

    Args:
        context: session; its list of readings is extended.
        ranger: ranger with the session's calibration.
        name: name of the step, under which the readings are journalled.
        placement: present placement; its key is the prefix of the scenes' names.
        count: number of readings.
        closest: reading of the closest range; None: mean range of the lasers on a flat across the axis.

    Raises:
        StoppedError, LaserOffNotConfirmedError: see `Context.capture`.
    """
    return [take_reading(context, ranger, name, placement, number, closest) for number in range(count)]


def take_reading(
    context: Context,
    ranger: Ranger,
    name: str,
    placement: Placement,
    number: int,
    closest: ClosestRange | None = None,
) -> ReadingTaken:
    """Take the reading `number` at a placement and journal it; see `take_readings`."""
    return take_full_reading(context, ranger, name, placement, number, closest)[0]


def take_full_reading(
    context: Context,
    ranger: Ranger,
    name: str,
    placement: Placement,
    number: int,
    closest: ClosestRange | None = None,
) -> tuple[ReadingTaken, Reading]:
    """Take the reading `number` at a placement; returns it as journalled and as the ranger gave it."""
    left_off = () if closest is None else closest.left_off
    scene = f"{placement.key}/{_without(closest)}{number:02d}"
    reading = acquire(ranger, scene, capture_of(context, ranger, placement, scene, number, left_off))
    taken = reading_taken(context.rig, ranger.sensor, name, placement, number, reading, closest)
    context.emit(taken)
    context.readings.append(taken)
    return taken, reading


def reading_taken(
    rig: Rig,
    sensor: CalibratedSensor,
    name: str,
    placement: Placement,
    number: int,
    reading: Reading,
    closest: ClosestRange | None = None,
) -> ReadingTaken:
    """Reading as it is journalled; arguments as of `take_readings`."""
    reference = Reference.of(rig.bench, placement)
    tilt = reference.at_point(reading.flat_at_mm)
    taken = ReadingTaken(
        trial=name,
        scene=reading.scene,
        standoff_mm=placement.standoff_mm,
        reading=number,
        status=reading.status,
        range_mm=reading.flat_mm,
        sigma_mm=reading.flat_sigma_mm,
        spot_sd_mm=reading.flat_spot_sd_mm,
        flat_true_mm=reference.true_mm(tilt),
        reference_sd_mm=reference.sd_mm(tilt),
        placement_sd_mm=reference.own_sd_mm(tilt),
        closest_mm=reading.closest_mm,
        closest_sigma_mm=reading.sigma_mm,
        shape=", ".join(line.shape.kind for line in reading.shapes),
        notes=reading.notes,
        lasers=reading.lasers,
        lasers_true_mm=reference.lasers_true_mm(sensor, reading.lasers),
    )
    return taken if closest is None else _closest_reading(taken, reading, closest)


def _without(closest: ClosestRange | None) -> str:
    """Part of a scene's name that states the missing spots; empty with all."""
    if closest is None:
        return ""
    parts = {"without": closest.left_off, "blocked": closest.blocked}
    return "".join(f"{name}-{'-'.join(ids)}/" for name, ids in parts.items() if ids)


def _closest_reading(taken: ReadingTaken, reading: Reading, closest: ClosestRange) -> ReadingTaken:
    shape = next((line.shape for line in reading.lines if line.row == closest.row), None)
    return taken.model_copy(
        update={
            "range_mm": reading.closest_mm,
            "sigma_mm": reading.sigma_mm,
            "spot_sd_mm": None,
            "flat_true_mm": None,
            "lasers_true_mm": (),
            "placement_sd_mm": None,
            **_interval(reading),
            "true": closest.true,
            "reference_sd_mm": closest.true.range_sd_mm,
            "left_off": closest.left_off,
            "blocked": closest.blocked,
            **_angle(shape),
            **_cylinder(shape, closest.front_mm),
        }
    )


def _angle(shape: Shape | None) -> dict[str, float]:
    if shape is None or shape.angle_rad is None or shape.angle_sigma_rad is None:
        return {}
    return {"angle_deg": degrees(shape.angle_rad), "angle_sd_deg": degrees(shape.angle_sigma_rad)}


def _cylinder(shape: Shape | None, front_mm: tuple[float, float]) -> dict[str, float]:
    if shape is None or (cylinder := shape.cylinder) is None:
        return {}
    nearest = cylinder.closest(front_mm)
    return {
        "radius_mm": cylinder.radius_mm,
        "radius_sd_mm": cylinder.radius_sigma_mm,
        "cylinder_mm": nearest.range_mm,
        "cylinder_sd_mm": nearest.sigma_mm,
    }


def _interval(reading: Reading) -> dict[str, float | None]:
    if reading.interval_mm is None:
        return {}
    low_mm, high_mm = reading.interval_mm
    return {"low_mm": low_mm, "high_mm": high_mm if isfinite(high_mm) else None}


def capture_of(
    context: Context,
    ranger: Ranger,
    placement: Placement,
    scene: str,
    number: int,
    left_off: tuple[str, ...] = (),
) -> Callable[[tuple[str, ...]], Finding]:
    """Function that takes a capture of the scene with the given lasers."""

    def capture(ids: tuple[str, ...]) -> Finding:
        if set(ids) <= set(left_off):
            return Finding(())
        alone = len(ids) == 1
        key = f"{scene}/{ids[0] if alone else 'all'}"
        name = f"{scene}/alone" if alone else scene
        return context.capture(
            key, ids, placement, number, ranger.searched(ids), scene=name, left_off=left_off
        )

    return capture
