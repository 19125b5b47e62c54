"""Schema of a world file: bodies around the vehicle that carries the sensor.

World frame: x and y on the floor, z up, mm. Headings count from +x towards +y, degrees.
"""

from __future__ import annotations

from math import cos, radians, sin, tan
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, ValidationInfo, field_validator, model_validator

from workbench.model.bounds import within
from workbench.model.prior import LARGEST
from workbench.model.yamlfile import FileModel, load_yaml_model

Coordinate = Annotated[float, within(-LARGEST, LARGEST, "millimetres")]
Length = Annotated[float, Field(gt=0), within(0, LARGEST, "millimetres")]
Heading = Annotated[float, within(-360, 360, "degrees")]
Albedo = Annotated[float, Field(ge=0, le=1)]
Point2 = tuple[Coordinate, Coordinate]
Point3 = tuple[Coordinate, Coordinate, Coordinate]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
STEEPEST_RAMP_DEG = 89.0
MOST_BODIES = 1000
"""Most bodies of a world, those of its objects counted."""


class _Body(FileModel):
    name: Name
    """Name of the body, unique in its list."""


class _Solid(_Body):
    albedo: Albedo | None = None
    """Diffuse reflectance; None: that of the rig's target."""


class PlaneBody(_Solid):
    """Plane without ends, such as a floor or a wall; bodies lie on the side of its normal."""

    kind: Literal["plane"]
    point_mm: Point3
    normal: tuple[float, float, float]
    """Direction towards the free side, of any length."""

    @field_validator("normal")
    @classmethod
    def _has_a_direction(cls, normal: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(normal):
            raise ValueError("expected a direction, got [0, 0, 0]")
        return normal


class BoxBody(_Solid):
    """Box that stands upright."""

    kind: Literal["box"]
    at_mm: Point2
    """Centre of its base."""
    size_mm: tuple[Length, Length, Length]
    """Length along its heading, width, height."""
    base_mm: Coordinate = 0.0
    """Height of its base above the floor."""
    heading_deg: Heading = 0.0


class PrismBody(_Solid):
    """Upright prism over a convex polygon."""

    kind: Literal["prism"]
    corners_mm: Annotated[tuple[Point2, ...], Field(min_length=3)]
    """Corners of the base, anticlockwise as seen from above."""
    height_mm: Length
    base_mm: Coordinate = 0.0

    @field_validator("corners_mm")
    @classmethod
    def _is_convex(cls, corners: tuple[Point2, ...]) -> tuple[Point2, ...]:
        for n, corner in enumerate(corners):
            (ax, ay), (bx, by) = corners[n - 1], corners[(n + 1) % len(corners)]
            turn = (corner[0] - ax) * (by - corner[1]) - (corner[1] - ay) * (bx - corner[0])
            if turn <= 0:
                raise ValueError(
                    f"expected a convex polygon, anticlockwise; it does not turn left at {list(corner)}"
                )
        return corners


class RampBody(_Solid):
    """Wedge that rises along its heading from the floor."""

    kind: Literal["ramp"]
    at_mm: Point2
    """Centre of its base."""
    length_mm: Length
    width_mm: Length
    angle_deg: Annotated[float, Field(gt=0, le=STEEPEST_RAMP_DEG)]
    base_mm: Coordinate = 0.0
    heading_deg: Heading = 0.0

    @property
    def height_mm(self) -> float:
        """Height of its upper end."""
        return self.length_mm * tan(radians(self.angle_deg))


class CylinderBody(_Solid):
    """Cylinder with flat ends, upright or lying along its heading."""

    kind: Literal["cylinder"]
    at_mm: Point2
    """Centre of its base, or of the line on which it lies."""
    radius_mm: Length
    length_mm: Length
    """Height of an upright cylinder."""
    lies: bool = False
    base_mm: Coordinate = 0.0
    """Height of its lowest point above the floor."""
    heading_deg: Heading = 0.0
    """Direction of the axis of a lying cylinder."""


class PoleBody(_Solid):
    """Thin round pole between two points, such as a leg of a chair."""

    kind: Literal["pole"]
    from_mm: Point3
    to_mm: Point3
    diameter_mm: Length

    @model_validator(mode="after")
    def _has_a_length(self) -> PoleBody:
        if self.from_mm == self.to_mm:
            raise ValueError("to_mm: expected another point than from_mm")
        return self


Solid = Annotated[
    PlaneBody | BoxBody | PrismBody | RampBody | CylinderBody | PoleBody, Field(discriminator="kind")
]


class CopyBody(_Body):
    """Copy of one of the world's objects, placed on the floor."""

    kind: Literal["copy"]
    of: Name
    """Name of the object."""
    at_mm: Point2
    heading_deg: Heading = 0.0


Body = Annotated[
    PlaneBody | BoxBody | PrismBody | RampBody | CylinderBody | PoleBody | CopyBody,
    Field(discriminator="kind"),
]


class Frame(NamedTuple):
    """Place of an object: its origin on the floor, and its heading."""

    x_mm: float = 0.0
    y_mm: float = 0.0
    heading_deg: float = 0.0

    def point(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Point of the world at a point of the object."""
        c, s = cos(radians(self.heading_deg)), sin(radians(self.heading_deg))
        return self.x_mm + c * x_mm - s * y_mm, self.y_mm + s * x_mm + c * y_mm


class PlacedSolid(NamedTuple):
    """Solid of the world, with the frame in which its values are given."""

    name: str
    solid: Solid
    frame: Frame


class World(FileModel):
    """A world file, format 1."""

    kind_key = "world"

    format: Literal[1]
    world: Name
    title: str
    objects: dict[Name, Annotated[tuple[Solid, ...], Field(min_length=1)]] = Field(default_factory=dict)
    """Bodies of objects that occur several times, about an origin on the floor."""
    bodies: Annotated[tuple[Body, ...], Field(min_length=1)]

    @field_validator("objects")
    @classmethod
    def _parts_differ(cls, objects: dict[str, tuple[Solid, ...]]) -> dict[str, tuple[Solid, ...]]:
        for name, parts in objects.items():
            _require_different(parts, f"{name}: ")
        return objects

    @field_validator("bodies")
    @classmethod
    def _bodies_are_known(cls, bodies: tuple[Body, ...], info: ValidationInfo) -> tuple[Body, ...]:
        _require_different(bodies)
        objects = info.data.get("objects")
        if objects is None:  # the objects themselves are wrong
            return bodies
        used = [body for body in bodies if isinstance(body, CopyBody)]
        if unknown := [body for body in used if body.of not in objects]:
            known = ", ".join(objects) or "none"
            raise ValueError(
                f"{unknown[0].name}: expected an object of this file ({known}), got {unknown[0].of}"
            )
        number = len(bodies) - len(used) + sum(len(objects[body.of]) for body in used)
        if number > MOST_BODIES:
            raise ValueError(f"expected at most {MOST_BODIES} bodies with those of objects, got {number}")
        return bodies

    def placed(self) -> list[PlacedSolid]:
        """All solids, in the order of the file; a part of an object is named `<body>/<part>`."""
        found = []
        for body in self.bodies:
            if isinstance(body, CopyBody):
                frame = Frame(*body.at_mm, body.heading_deg)
                parts = self.objects[body.of]
                found += [PlacedSolid(f"{body.name}/{part.name}", part, frame) for part in parts]
            else:
                found.append(PlacedSolid(body.name, body, Frame()))
        return found


class Vehicle(FileModel):
    """Vehicle with the sensor in the middle of its front; the front is the sensor's reference plane."""

    length_mm: Length = 240.0
    width_mm: Length = 180.0
    height_mm: Length = 120.0
    clearance_mm: Annotated[float, within(0, LARGEST, "millimetres")] = 20.0
    """Height above the floor of its lowest part; what is lower is no obstacle."""
    sensor_height_mm: Coordinate = 60.0
    """Height of the camera above the floor."""

    @model_validator(mode="after")
    def _has_a_front(self) -> Vehicle:
        if self.clearance_mm >= self.height_mm:
            raise ValueError(f"clearance_mm: expected less than height_mm, {self.height_mm:g}")
        return self


class Pose(FileModel):
    """Pose of the vehicle: middle of its front on the floor, and its heading."""

    x_mm: Coordinate
    y_mm: Coordinate
    heading_deg: Heading = 0.0

    def ahead(self, distance_mm: float) -> Pose:
        """Pose after a straight drive."""
        angle = radians(self.heading_deg)
        return Pose(
            x_mm=self.x_mm + distance_mm * cos(angle),
            y_mm=self.y_mm + distance_mm * sin(angle),
            heading_deg=self.heading_deg,
        )


def load_world(path: Path) -> World:
    """Read a world file.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    return load_yaml_model(path, World)


def _require_different(bodies: tuple[_Body, ...], where: str = "") -> None:
    names = [body.name for body in bodies]
    if doubled := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"{where}expected distinct names, got {doubled[0]} more than once")
