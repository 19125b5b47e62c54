"""Step `drive`: drive the sensor through a world, and compare its answers with the truth and a sonar."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from workbench.model.bounds import within
from workbench.model.errors import BadInputError
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import PositiveFloat, Rig
from workbench.model.target import Placement, WorldTarget
from workbench.model.world import Pose, Vehicle, World
from workbench.model.yamlfile import Document, include_content
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import result_limit_prompts
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.drive.schema import MOST_STEPS, Brakes, Drive, Sonar
from workbench.trials.trial_step import ResultLimits

WORLD = "world"


class DriveLimits(ResultLimits):
    """Limits on the results over all drives."""

    missed_met: Limit | None = None
    """Limit on the number of obstacles on a collision course that a beam meets and the sensor misses."""
    missed: Limit | None = None
    """Limit on the number of all obstacles on a collision course that the sensor misses."""
    false_stops: Limit | None = None
    """Limit on the number of drives that the sensor stops without an obstacle."""


@register
class DriveStep(StepModel):
    """Drive the sensor on its vehicle through a world; one row a step, compared with truth and sonar.

    A drive ends with its path, or where an obstacle is nearer than the braking distance.
    """

    needs: ClassVar[str | None] = "calibration"
    gives: ClassVar[str | None] = "readings"
    step: Literal["drive"]
    world: World
    """In a file: path of a world file, relative to it."""
    vehicle: Vehicle = Vehicle()
    drives: Annotated[tuple[Drive, ...], Field(min_length=1)]
    step_mm: Annotated[float, Field(gt=0), within(1, 1000, "millimetres")] = 10.0
    brakes: Brakes = Brakes()
    stop_mm: PositiveFloat = 250.0
    """Range at which an answer of a sensor stops the vehicle."""
    margin_mm: PositiveFloat = 100.0
    """Distance of the obstacle beyond `stop_mm` from which a stop is false."""
    sonar: Sonar = Sonar()
    seed: Annotated[int, within(0, 2**32 - 1, "32 bits")] = 1
    """Seed of the sonar's noise."""
    limits: DriveLimits = DriveLimits()

    @classmethod
    def include_files(cls, document: Document) -> bool:
        """Replace the path of the world file by its content."""
        return include_content(document, WORLD, World, "world file")

    @field_validator("world", mode="before")
    @classmethod
    def _is_included(cls, world: Any) -> Any:
        if isinstance(world, str):
            raise ValueError(f"expected the content of a world, got the path {world}")
        return world

    @model_validator(mode="after")
    def _drives_are_possible(self) -> DriveStep:
        names = [drive.name for drive in self.drives]
        if doubled := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"drives: expected distinct names, got {doubled[0]} more than once")
        if self.stop_mm <= self.brakes.distance_mm:
            raise ValueError(
                f"stop_mm: expected more than the braking distance, {self.brakes.distance_mm:.4g} mm, got"
                f" {self.stop_mm:g}"
            )
        return self

    @property
    def title(self) -> str:
        """World, and numbers of drives and steps."""
        steps = sum(len(one) for one in self.ways)
        return (
            f"{counted(len(self.drives), 'drive')} in the world {self.world.world}, {counted(steps, 'step')}"
        )

    @cached_property
    def ways(self) -> list[list[Pose]]:
        """Poses of each drive, up to the last from which the vehicle can brake.

        Raises:
            BadInputError: a drive starts too near an obstacle, or has too many steps.
        """
        # Imported here: checking a file must not import the geometry.
        from workbench.trials.drive.surroundings import Surroundings

        around, found = Surroundings(self.world), []
        for drive in self.drives:
            poses = drive.poses(self.step_mm)
            if len(poses) > MOST_STEPS:
                raise BadInputError(
                    f"drive {drive.name}: expected at most {MOST_STEPS} steps, got {len(poses)}"
                )
            free = [around.clearance(pose, self.vehicle).distance_mm for pose in poses]
            end = next((n for n, mm in enumerate(free) if mm < self.brakes.distance_mm), len(poses))
            if end == 0:
                raise BadInputError(
                    f"drive {drive.name}: expected a start with at least the braking distance,"
                    f" {self.brakes.distance_mm:.4g} mm, ahead; got {free[0]:.4g} mm"
                )
            found.append(poses[:end])
        return found

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per drive, at its start."""
        from workbench.trials.drive.surroundings import Surroundings

        around = Surroundings(self.world)
        placements = []
        for drive, way in zip(self.drives, self.ways, strict=True):
            free_mm = round(min(around.clearance(way[0], self.vehicle).distance_mm, FARTHEST_MM), 1)
            target = WorldTarget(
                world=self.world, vehicle=self.vehicle, pose=way[0], speed_mm_s=self.brakes.speed_mm_s
            )
            placements.append(
                Placement(
                    key=f"{name}/{drive.name}",
                    standoff_mm=free_mm,
                    standoff_sd_mm=free_mm,  # it need not be measured
                    target=target,
                )
            )
        return placements

    def captures(self, rig: Rig) -> int:
        """One capture per step; ambiguous readings take further captures of single lasers."""
        return sum(len(way) for way in self.ways)

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements and of limits."""
        return [*super().prompts(name, rig), *result_limit_prompts(name, self.limits)]

    def run(self, context: Context, name: str) -> str:
        """Drive, and write the results.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.drive.trial import run_trial

        return run_trial(context, name, self)


FARTHEST_MM = 100_000.0
"""Standoff that is stated for a way without an obstacle."""
