"""Targets of trials as in a procedure file, their placements, and the true values of their readings.

The range of a trial is the number that `workbench range` prints: the closest range over the front, between
the origins of the outer lasers of a line.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, radians, sqrt, tan
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from workbench.model.errors import BadInputError
from workbench.model.event import TrueValues
from workbench.model.prior import LARGEST
from workbench.model.rig import BenchSpec, NonNegativeFloat, Rig
from workbench.model.target import CylinderTarget, FlatTarget, Placement
from workbench.model.yamlfile import FileModel
from workbench.optics.rows import Row, rays_of_rig, rows_of
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.reference import ON_AXIS, Reference, front_ends

RULER_DECIMALS = 1
"""Decimals of a standoff in mm that is asked for: a ruler can be read to 0.1 mm."""
STEEPEST_DEG = 80.0
"""Largest angle of an incline; beyond it a spot is longer than six times its width."""
STEEPEST_ON_CYLINDER = 0.95
"""Largest distance of a beam from the axis of a cylinder, in radii, at which its spot can be measured."""
FEWEST_ON_CYLINDER = 3
"""Lasers of one line that must hit a cylinder: a circle has three parameters."""


def _is_turned(angle_deg: float) -> float:
    if angle_deg == 0:
        raise ValueError("expected an angle other than 0; a target square to the axis is `kind: flat`")
    return angle_deg


class FlatTargetSpec(FileModel):
    """Flat target square to the optical axis."""

    kind: Literal["flat"] = "flat"
    reference_sd_mm: NonNegativeFloat | None = None
    """Standard uncertainty of the standoff; None: the rig's `placement_sd_mm`."""


class InclineSpec(FileModel):
    """Flat target turned about the vertical or the horizontal axis."""

    kind: Literal["incline"]
    angle_deg: Annotated[float, Field(ge=-STEEPEST_DEG, le=STEEPEST_DEG), AfterValidator(_is_turned)]
    """Positive: the right (about the horizontal: lower) side is farther away."""
    axis: Literal["vertical", "horizontal"] = "vertical"
    """Axis of the turn: vertical for lasers beside the camera, horizontal for lasers above or below it."""
    reference_sd_deg: NonNegativeFloat = 0.1
    """Standard uncertainty of the angle: 0.1 deg by a digital level, 0.02 deg by a sine bar."""
    reference_sd_mm: NonNegativeFloat | None = None
    """Standard uncertainty of the standoff; None: the rig's `placement_sd_mm`."""


class CylinderSpec(FileModel):
    """Cylinder with a vertical axis."""

    kind: Literal["cylinder"]
    diameter_mm: Annotated[float, Field(gt=0, le=LARGEST)]
    shift_mm: Annotated[float, Field(ge=-LARGEST, le=LARGEST)] = 0.0
    """x of its axis in the camera frame."""
    diameter_sd_mm: NonNegativeFloat = 0.1
    """Standard uncertainty of the diameter: 0.1 mm by a calliper."""
    reference_sd_mm: NonNegativeFloat | None = None
    """Standard uncertainty of the standoff; None: the rig's `placement_sd_mm`."""


TargetSpec = Annotated[FlatTargetSpec | InclineSpec | CylinderSpec, Field(discriminator="kind")]


def front_angle_deg(spec: TargetSpec) -> int:
    """Angle of the row of lasers that measures the target's angle or radius."""
    return 90 if isinstance(spec, InclineSpec) and spec.axis == "horizontal" else 0


def target_placement(spec: TargetSpec, key: str, range_mm: float, rig: Rig) -> Placement:
    """Placement at which the closest range over the rig's front is `range_mm`, as far as a ruler can be read.

    The standoff is that on the optical axis for a flat target, that of the nearest line for a cylinder.

    Raises:
        BadInputError: the rig's lasers cannot see the target.
    """
    front = _rig_front(spec, rig)
    if isinstance(spec, CylinderSpec):
        _check_cylinder(spec, front, key)
        shape = CylinderTarget(
            diameter_mm=spec.diameter_mm, shift_mm=spec.shift_mm, diameter_sd_mm=spec.diameter_sd_mm
        )
        recess_mm = _cylinder_recess_mm(spec, (min(front), max(front)))
        standoff_mm = round(range_mm - recess_mm, RULER_DECIMALS)
        return Placement(key=key, standoff_mm=standoff_mm, target=shape, standoff_sd_mm=spec.reference_sd_mm)
    if isinstance(spec, FlatTargetSpec):
        return Placement(key=key, standoff_mm=range_mm, standoff_sd_mm=spec.reference_sd_mm)
    if len(front) < 2:
        raise BadInputError(
            f"{key}: target: expected 2 lasers or more in a row across the turn about the {spec.axis} axis,"
            f" got {len(front)}; turn the target about the other axis"
        )
    turn = {"yaw_deg" if spec.axis == "vertical" else "pitch_deg": spec.angle_deg}
    return Placement(
        key=key,
        standoff_mm=round(range_mm + _lead_mm(_angle_deg(spec, rig.bench), front), RULER_DECIMALS),
        target=FlatTarget(turn_sd_deg=spec.reference_sd_deg, **turn),
        standoff_sd_mm=spec.reference_sd_mm,
    )


def true_values(spec: TargetSpec, placed: Placement, sensor: CalibratedSensor, rig: Rig) -> TrueValues:
    """True values at a placement as measured; the front is that of the calibration.

    The closest range of a flat target is that of its near end: closer on average, with the uncertainty of its
    squareness. The tilt common to all placements, as measured, adds to a set angle, and its uncertainty to
    that of the angle. The uncertainties of ranges contain the ruler's scale.
    """
    reference = Reference.of(rig.bench, placed)
    on_axis_mm, on_axis_sd_mm = reference.true_mm(ON_AXIS), reference.sd_mm(ON_AXIS)
    if isinstance(spec, FlatTargetSpec):
        tilt = reference.at_near_end(front_ends(sensor, placed.standoff_mm))
        return TrueValues(range_mm=reference.true_mm(tilt), range_sd_mm=reference.sd_mm(tilt))
    row = front_row(spec, sensor)
    if row is None:
        raise BadInputError(
            f"{placed.key}: target: expected two calibrated lasers or more in a row at"
            f" {front_angle_deg(spec)} degrees, got none; calibrate this rig again"
        )
    front = sensor.front_mm(row, placed.standoff_mm)
    if isinstance(spec, CylinderSpec):
        return TrueValues(
            range_mm=on_axis_mm + _cylinder_recess_mm(spec, front),
            range_sd_mm=on_axis_sd_mm,
            radius_mm=spec.diameter_mm / 2,
            radius_sd_mm=spec.diameter_sd_mm / 2,
        )
    angle_deg = _angle_deg(spec, rig.bench)
    arm_mm = abs(front[0] if angle_deg > 0 else front[1])
    angle_sd_deg = hypot(spec.reference_sd_deg, rig.bench.target_tilt_sd_deg)
    lead_sd_mm = arm_mm / cos(radians(angle_deg)) ** 2 * radians(angle_sd_deg)
    return TrueValues(
        range_mm=on_axis_mm - _lead_mm(angle_deg, front),
        range_sd_mm=hypot(on_axis_sd_mm, lead_sd_mm),
        angle_deg=angle_deg,
        set_deg=spec.angle_deg,
        angle_sd_deg=angle_sd_deg,
    )


def _rig_front(spec: TargetSpec, rig: Rig) -> list[float]:
    """Positions of the lasers of the row across the target, mm along it, as designed; empty without one."""
    rays = rays_of_rig(rig)
    rows = [row for row in rows_of(rays) if row.angle_deg == front_angle_deg(spec)]
    row = max(rows, key=lambda one: len(one.members), default=None)
    return [] if row is None else (rays[row.lasers, :2] @ row.direction).tolist()


def front_row(spec: TargetSpec, sensor: CalibratedSensor) -> Row | None:
    """Row of the sensor that measures the target's angle or radius; None without one."""
    return sensor.row_at(front_angle_deg(spec))


def _angle_deg(spec: InclineSpec, bench: BenchSpec) -> float:
    """Angle to the sensor: as set, with the tilt common to all placements as measured."""
    common_deg = bench.target_yaw_deg if spec.axis == "vertical" else bench.target_pitch_deg
    return spec.angle_deg + common_deg


def _lead_mm(angle_deg: float, front_mm: Sequence[float]) -> float:
    """Distance by which the near end of the front is closer than the optical axis."""
    slope = tan(radians(angle_deg))
    return max(-slope * end for end in front_mm)


def _cylinder_recess_mm(spec: CylinderSpec, front_mm: tuple[float, float]) -> float:
    """Distance from the nearest line of the cylinder to its closest point over the front."""
    radius_mm = spec.diameter_mm / 2
    aside_mm = spec.shift_mm - min(max(spec.shift_mm, front_mm[0]), front_mm[1])
    return radius_mm - sqrt(max(radius_mm**2 - aside_mm**2, 0.0))


def _check_cylinder(spec: CylinderSpec, front: list[float], key: str) -> None:
    aside = sorted(abs(x_mm - spec.shift_mm) for x_mm in front)
    if len(aside) < FEWEST_ON_CYLINDER:
        raise BadInputError(
            f"{key}: target: expected {FEWEST_ON_CYLINDER} lasers or more beside the camera to measure a"
            f" vertical cylinder, got {len(aside)}"
        )
    needed_mm = 2 * aside[FEWEST_ON_CYLINDER - 1] / STEEPEST_ON_CYLINDER
    if spec.diameter_mm < needed_mm:
        raise BadInputError(
            f"{key}: target.diameter_mm: expected {needed_mm:.4g} mm or more, so that {FEWEST_ON_CYLINDER}"
            f" beams hit it at less than {STEEPEST_ON_CYLINDER:g} radii from its axis, got"
            f" {spec.diameter_mm:g} mm"
        )
