"""3D view of a world, in its frame, mm: bodies, the vehicle on its way, the answers of its sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, radians, sin

import numpy as np
import rerun as rr

from workbench.model.event import LaserRange, VehicleMoved
from workbench.model.target import WorldTarget
from workbench.model.trial_event import SensorAnswer
from workbench.model.world import (
    CylinderBody,
    Frame,
    PlacedSolid,
    PlaneBody,
    PoleBody,
    Pose,
    PrismBody,
    RampBody,
    Vehicle,
)
from workbench.viewer import entities as at
from workbench.viewer.geometry import Geometry
from workbench.viewer.stream import Stream

SEGMENTS = 24
"""Chords of a drawn circle or arc."""
LONGEST_MM = 12_000.0
"""Longest drawn answer."""
_LINE = rr.Radius.ui_points(1.2)
_THICK = rr.Radius.ui_points(3.0)

Point = tuple[float, float, float]
Strip = list[Point]


def log_world(stream: Stream, target: WorldTarget) -> None:
    """Log the edges of all bodies; planes without ends are left out."""
    stream.log(at.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    strips = [strip for placed in target.world.placed() for strip in edges(placed)]
    stream.log(at.WORLD_BODIES, rr.LineStrips3D(strips, colors=at.GREY, radii=_LINE))
    _log_vehicle(stream, target.vehicle, target.pose)


def log_step(
    stream: Stream,
    event: VehicleMoved,
    vehicle: Vehicle,
    lasers: Sequence[LaserRange],
    geometry: Geometry,
    colors: Mapping[str, at.Rgb],
) -> None:
    """Log the vehicle at one step, the beams up to their ranges, and the answers.

    Args:
        stream: recording.
        event: step.
        vehicle: its size, and the height of the sensor.
        lasers: ranges of the reading at this step.
        geometry: rays of the lasers.
        colors: colours of the lasers.
    """
    _log_vehicle(stream, vehicle, event.pose)
    known = [one for one in lasers if one.laser_id in geometry.rays]
    beams = [
        [
            _seen(event.pose, vehicle, geometry.ray_at(one.laser_id, mm + geometry.offset_mm), geometry)
            for mm in (0.0, one.range_mm)
        ]
        for one in known
    ]
    stream.log(
        at.WORLD_BEAMS,
        rr.LineStrips3D(
            beams, colors=[colors[one.laser_id] for one in known], radii=_LINE if beams else None
        ),
    )
    for answer in event.answers:
        strips = [answer_strip(event.pose, vehicle, answer)] if answer.range_mm is not None else []
        color = at.RED if answer.full_angle_deg else at.WHITE
        stream.log(
            at.under(at.WORLD_ANSWERS, answer.sensor),
            rr.LineStrips3D(strips, colors=color, radii=_THICK if strips else None),
        )


def answer_strip(pose: Pose, vehicle: Vehicle, answer: SensorAnswer) -> Strip:
    """Line over the front at an answer's range, or the arc of its cone."""
    mm = min(answer.range_mm or 0.0, LONGEST_MM)
    z = vehicle.sensor_height_mm
    if not answer.full_angle_deg:
        half = vehicle.width_mm / 2
        return [(*_ahead(pose, mm, side), z) for side in (-half, half)]
    half = radians(answer.full_angle_deg / 2)
    angles = np.linspace(-half, half, SEGMENTS + 1).tolist()
    return [(*_ahead(pose, mm * cos(a), mm * sin(a)), z) for a in angles]


def edges(placed: PlacedSolid) -> list[Strip]:
    """Edges of a solid in the world; none of a plane."""
    solid, frame = placed.solid, placed.frame
    if isinstance(solid, PlaneBody):
        return []
    if isinstance(solid, PoleBody):
        return [[_moved(frame, solid.from_mm), _moved(frame, solid.to_mm)]]
    if isinstance(solid, CylinderBody):
        return [[_moved(frame, point) for point in strip] for strip in _cylinder(solid)]
    if isinstance(solid, PrismBody):
        base = [*solid.corners_mm]
        tops = [solid.base_mm + solid.height_mm] * len(base)
    else:
        own = Frame(*solid.at_mm, solid.heading_deg)
        length, width = (
            (solid.length_mm, solid.width_mm) if isinstance(solid, RampBody) else solid.size_mm[:2]
        )
        base = [own.point(x * length / 2, y * width / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        if isinstance(solid, RampBody):
            tops = [solid.base_mm + rise * solid.height_mm for rise in (0, 1, 1, 0)]
        else:
            tops = [solid.base_mm + solid.size_mm[2]] * len(base)
    lower = [_moved(frame, (*point, solid.base_mm)) for point in base]
    upper = [_moved(frame, (*point, top)) for point, top in zip(base, tops, strict=True)]
    upright = [[a, b] for a, b in zip(lower, upper, strict=True)]
    return [[*lower, lower[0]], [*upper, upper[0]], *upright]


def _cylinder(solid: CylinderBody) -> list[Strip]:
    angles = np.linspace(0, 2 * np.pi, SEGMENTS + 1).tolist()
    r, own = solid.radius_mm, Frame(*solid.at_mm, solid.heading_deg)
    if not solid.lies:
        rings = [
            [(*own.point(r * cos(a), r * sin(a)), solid.base_mm + z) for a in angles]
            for z in (0.0, solid.length_mm)
        ]
    else:
        half, middle = solid.length_mm / 2, solid.base_mm + r
        rings = [[(*own.point(x, r * cos(a)), middle + r * sin(a)) for a in angles] for x in (-half, half)]
    return [*rings, *([rings[0][n], rings[1][n]] for n in (0, SEGMENTS // 2))]


def _log_vehicle(stream: Stream, vehicle: Vehicle, pose: Pose) -> None:
    half = vehicle.width_mm / 2
    corners = [(0.0, -half), (0.0, half), (-vehicle.length_mm, half), (-vehicle.length_mm, -half)]
    lower, upper = (
        [(*_ahead(pose, x, y), z) for x, y in corners] for z in (vehicle.clearance_mm, vehicle.height_mm)
    )
    upright = [[a, b] for a, b in zip(lower, upper, strict=True)]
    strips = [[*lower, lower[0]], [*upper, upper[0]], *upright]
    stream.log(at.WORLD_VEHICLE, rr.LineStrips3D(strips, colors=at.WHITE, radii=_LINE))


def _ahead(pose: Pose, ahead_mm: float, left_mm: float) -> tuple[float, float]:
    return Frame(pose.x_mm, pose.y_mm, pose.heading_deg).point(ahead_mm, left_mm)


def _seen(pose: Pose, vehicle: Vehicle, point: Point, geometry: Geometry) -> Point:
    """Point of the world at a point of the camera frame."""
    x, y, z = point
    return (*_ahead(pose, z - geometry.offset_mm, -x), vehicle.sensor_height_mm - y)


def _moved(frame: Frame, point: Sequence[float]) -> Point:
    x, y, z = point
    return (*frame.point(x, y), z)
