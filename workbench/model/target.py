"""Shapes of the target and its placement in front of the sensor."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from workbench.model.world import Pose, Vehicle, World
from workbench.model.yamlfile import FileModel


class FlatTarget(FileModel):
    """Plane across the optical axis at the standoff, turned about its vertical and its horizontal axis."""

    shape: Literal["flat"] = "flat"
    yaw_deg: float = 0.0
    """About the vertical: positive moves the side at +x away from the sensor."""
    pitch_deg: float = 0.0
    """About the horizontal: positive moves the side at +y (below) away from the sensor."""
    finish: Literal["matt", "absorbent", "mirror"] = "matt"
    width_mm: Annotated[float, Field(gt=0)] | None = None
    """Width along the face; None: wider than the field of view. Beams may miss a narrow target."""
    height_mm: Annotated[float, Field(gt=0)] | None = None
    shift_mm: float = 0.0
    """x of the centre of a target with a stated width; the standoff remains that of the plane at x = 0."""
    turn_sd_deg: Annotated[float, Field(ge=0)] | None = None
    """Standard uncertainty of the larger of the two angles, as measured; None: the rig's `tilt_sd_deg`."""

    @property
    def turn_sds_deg(self) -> tuple[float | None, float | None]:
        """Standard uncertainties of yaw and pitch as measured; None: the rig's `tilt_sd_deg`."""
        about_vertical = abs(self.yaw_deg) >= abs(self.pitch_deg)
        return (self.turn_sd_deg, None) if about_vertical else (None, self.turn_sd_deg)


class BoardTarget(FileModel):
    """Printed board of the rig file: a plane like that of a flat target, with the spots on its band."""

    shape: Literal["board"] = "board"
    yaw_deg: float = 0.0
    """About the vertical: positive moves the side at +x away from the sensor."""
    pitch_deg: float = 0.0
    """About the horizontal: positive moves the side at +y (below) away from the sensor."""
    roll_deg: float = 0.0
    """Rotation in its own plane; 90 makes the band vertical, for lasers above and below the camera."""


class CylinderTarget(FileModel):
    """Vertical cylinder with its nearest point at the standoff and its axis at x = `shift_mm`."""

    shape: Literal["cylinder"] = "cylinder"
    diameter_mm: Annotated[float, Field(gt=0)]
    shift_mm: float = 0.0
    diameter_sd_mm: Annotated[float, Field(ge=0)] | None = None
    """Standard uncertainty of the diameter; None: unknown."""


class PolynomialTarget(FileModel):
    """Vertical surface z = standoff + sum of c[k] (x - shift)^(k + 1), x and z in mm, degree 1 to 4."""

    shape: Literal["polynomial"] = "polynomial"
    coefficients: Annotated[tuple[float, ...], Field(min_length=1, max_length=4)]
    shift_mm: float = 0.0


class NoTarget(FileModel):
    """No target: the beams hit nothing."""

    shape: Literal["none"] = "none"


class WorldTarget(FileModel):
    """World in front of the sensor on its vehicle; the standoff is the clearance at the pose."""

    shape: Literal["world"] = "world"
    world: World
    vehicle: Vehicle = Vehicle()
    pose: Pose
    speed_mm_s: Annotated[float, Field(ge=0)] = 0.0
    """Speed along the heading during an exposure."""


TargetShape = Annotated[
    FlatTarget | BoardTarget | CylinderTarget | PolynomialTarget | NoTarget | WorldTarget,
    Field(discriminator="shape"),
]


def is_measured(standoff_mm: float, standoff_sd_mm: float | None) -> bool:
    """Whether a standoff is measured: one that need not be has an uncertainty of its own size."""
    return standoff_sd_mm is None or standoff_sd_mm < standoff_mm


class Placement(FileModel):
    """One positioning of the target. All captures with the same `key` share its placement error."""

    key: str
    standoff_mm: Annotated[float, Field(gt=0)]
    """Standoff by the ruler, from the rig's reference plane."""
    target: TargetShape = FlatTarget()
    standoff_sd_mm: Annotated[float, Field(ge=0)] | None = None
    """Standard uncertainty of the standoff; None: the rig's `placement_sd_mm`."""
    attempt: int = 1
    """Number of times that the session has been at this placement; repairs count."""
    blocked: tuple[str, ...] = ()
    """Lasers whose beams are blocked before they meet the target."""
    head_deg: float | None = None
    """Reading of the scanning head's encoder; None: a sensor without head, or with its head at 0."""

    @property
    def is_measured(self) -> bool:
        """Whether the standoff was to be measured."""
        return is_measured(self.standoff_mm, self.standoff_sd_mm)
