"""What stands in front of the sensor, and where the technician was asked to put it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from workbench.model.yamlfile import FileModel


class FlatTarget(FileModel):
    """A plane across the optical axis at the standoff, turned about its vertical and its horizontal axis."""

    shape: Literal["flat"] = "flat"
    yaw_deg: float = 0.0
    """About the vertical: positive moves the side at +x away from the sensor."""
    pitch_deg: float = 0.0
    """About the horizontal: positive moves the side at +y (below) away from the sensor."""
    finish: Literal["matt", "absorbent", "mirror"] = "matt"
    width_mm: Annotated[float, Field(gt=0)] | None = None
    """Along the face; without one the target is wider than the field of view. A small one lets beams miss."""
    height_mm: Annotated[float, Field(gt=0)] | None = None
    shift_mm: float = 0.0
    """x of the centre of a target of a stated width; the standoff is still that of the plane at x = 0."""


class BoardTarget(FileModel):
    """The printed board of the rig file, its plane as that of a flat target, its band across the spots."""

    shape: Literal["board"] = "board"
    yaw_deg: float = 0.0
    """About the vertical: positive moves the side at +x away from the sensor."""
    pitch_deg: float = 0.0
    """About the horizontal: positive moves the side at +y (below) away from the sensor."""
    roll_deg: float = 0.0
    """In its own plane; 90 puts the band upright, for lasers above and below the camera."""


class CylinderTarget(FileModel):
    """A vertical cylinder whose nearest point lies at the standoff, its axis at x = `shift_mm`."""

    shape: Literal["cylinder"] = "cylinder"
    diameter_mm: Annotated[float, Field(gt=0)]
    shift_mm: float = 0.0


class PolynomialTarget(FileModel):
    """A vertical surface z = standoff + sum of c[k] (x - shift)^(k + 1), x and z in mm, degree 1 to 4."""

    shape: Literal["polynomial"] = "polynomial"
    coefficients: Annotated[tuple[float, ...], Field(min_length=1, max_length=4)]
    shift_mm: float = 0.0


class NoTarget(FileModel):
    """Nothing in the beams' way."""

    shape: Literal["none"] = "none"


TargetShape = Annotated[
    FlatTarget | BoardTarget | CylinderTarget | PolynomialTarget | NoTarget, Field(discriminator="shape")
]


class Placement(FileModel):
    """One placing of the target. Everything measured under the same `key` shares its placement error."""

    key: str
    standoff_mm: Annotated[float, Field(gt=0)]
    """By the ruler, from the rig's reference plane."""
    target: TargetShape = FlatTarget()
    standoff_sd_mm: Annotated[float, Field(ge=0)] | None = None
    """How well the standoff is known, 1 sigma, where not as well as the rig's `placement_sd_mm`."""
