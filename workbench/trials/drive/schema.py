"""Schema of drives in a world: their paths, the vehicle's brakes, and the simulated sonar."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, hypot
from typing import Annotated

from pydantic import Field, model_validator

from workbench.model.bounds import within
from workbench.model.fields import Standoff
from workbench.model.rig import NonNegativeFloat, PositiveFloat
from workbench.model.world import Pose
from workbench.model.yamlfile import FileModel

MOST_STEPS = 100_000


class Drive(FileModel):
    """One drive: straight from its start, or along a path of poses."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    start: Pose
    distance_mm: Standoff | None = None
    """Length of a straight drive."""
    path: tuple[Pose, ...] = ()
    """Poses after the start. Between two of them the vehicle drives straight and turns evenly."""

    @model_validator(mode="after")
    def _has_one_way(self) -> Drive:
        if (self.distance_mm is None) == (not self.path):
            raise ValueError("expected distance_mm or path, not both")
        points = [self.start, *self.path]
        for before, after in pairwise(points):
            if (before.x_mm, before.y_mm) == (after.x_mm, after.y_mm):
                raise ValueError(
                    f"path: expected different places, got {before.x_mm:g}, {before.y_mm:g} twice"
                )
        return self

    def poses(self, step_mm: float) -> list[Pose]:
        """Poses from the start, `step_mm` apart; the last step of each part of a path may be shorter."""
        if self.distance_mm is not None:
            count = int(self.distance_mm / step_mm + 1e-9)
            return [self.start.ahead(n * step_mm) for n in range(count + 1)]
        found = [self.start]
        for before, after in pairwise([self.start, *self.path]):
            length = hypot(after.x_mm - before.x_mm, after.y_mm - before.y_mm)
            count = ceil(length / step_mm - 1e-9)
            shares = [min(n * step_mm / length, 1.0) for n in range(1, count + 1)]
            found += [_between(before, after, share) for share in shares]
        return found


def _between(before: Pose, after: Pose, share: float) -> Pose:
    turn = (after.heading_deg - before.heading_deg + 180) % 360 - 180
    return Pose(
        x_mm=before.x_mm + share * (after.x_mm - before.x_mm),
        y_mm=before.y_mm + share * (after.y_mm - before.y_mm),
        heading_deg=before.heading_deg + share * turn,
    )


class Brakes(FileModel):
    """Speed of the vehicle, and its way to rest after an answer of the sensor."""

    speed_mm_s: PositiveFloat = 300.0
    reaction_s: NonNegativeFloat = 0.13
    """Time from the exposure to the brakes; the thesis's worst case."""
    deceleration_mm_s2: PositiveFloat = 1000.0

    @property
    def distance_mm(self) -> float:
        """Braking distance: v t + v^2 / (2 a)."""
        return self.speed_mm_s * self.reaction_s + self.speed_mm_s**2 / (2 * self.deceleration_mm_s2)


class Sonar(FileModel):
    """Simulated ultrasonic ranger: first echo within a cone, without surfaces that reflect it away."""

    full_angle_deg: Annotated[float, Field(gt=0, le=120)] = 30.0
    specular_deg: Annotated[float, Field(gt=0, le=90)] = 25.0
    """Angle of incidence beyond which a smooth surface returns no echo."""
    nearest_mm: NonNegativeFloat = 150.0
    """Shortest range; nearer bodies answer with it."""
    farthest_mm: PositiveFloat = 10_700.0
    relative_sd: Annotated[float, within(0, 1, "relative")] = 0.01
    """Noise, 1 sigma."""
