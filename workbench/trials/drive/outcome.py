"""Records of a drive, and its outcome for each sensor: missed obstacles, false stops, clearance at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite

from workbench.model.event import ReadingTaken
from workbench.model.world import Pose
from workbench.trials.drive.step import DriveStep
from workbench.trials.drive.truth import StepTruth

NEAREST, CLOSEST, SONAR = "nearest spot", "closest", "sonar"
"""Answers that may stop the vehicle: the smallest range of a single laser, the closest range over the front
by the shape of one surface, and the sonar."""
SENSORS = (NEAREST, CLOSEST, SONAR)


@dataclass(frozen=True)
class StepRecord:
    """One step: pose, truth, and the answers of both sensors."""

    number: int
    pose: Pose
    truth: StepTruth
    reading: ReadingTaken
    sonar_mm: float | None
    exposure: float | None

    @property
    def clearance_mm(self) -> float:
        """True way ahead until the vehicle touches a body."""
        return self.truth.clearance.distance_mm

    @property
    def answers(self) -> dict[str, float | None]:
        """Range of each sensor."""
        return {
            NEAREST: min((one.range_mm for one in self.reading.lasers), default=None),
            CLOSEST: self.reading.range_mm,
            SONAR: self.sonar_mm,
        }


@dataclass(frozen=True)
class Outcome:
    """Outcome of a drive for one sensor."""

    sensor: str
    stop_mm: float | None
    """True clearance at the first answer that stops the vehicle; None: none stops it."""
    rest_mm: float
    """Smallest clearance of the drive with that stop: after braking, or on the whole way; 0: a collision."""
    missed: bool
    """Whether the vehicle collides although no answer had asked for a stop in time."""
    false_stop: bool
    """Whether it stops although the nearest body is far beyond the stopping range."""


@dataclass(frozen=True)
class DriveRecord:
    """One drive with its outcomes."""

    key: str
    name: str
    steps: Sequence[StepRecord]
    obstacle: str
    """Body on the collision course; empty without one."""
    is_met: bool
    """Whether a beam meets a body within the stopping range while the vehicle can still brake."""
    outcomes: Sequence[Outcome]

    @classmethod
    def of(cls, key: str, step: DriveStep, bodies: Sequence[str], steps: Sequence[StepRecord]) -> DriveRecord:
        """Record of a drive whose steps end where the vehicle can just brake, or with its path."""
        last = steps[-1].truth.clearance
        collides = last.distance_mm < step.brakes.distance_mm + step.step_mm
        in_time = [one for one in steps if one.clearance_mm >= step.brakes.distance_mm]
        return cls(
            key=key,
            name=key.rpartition("/")[2],
            steps=steps,
            obstacle=bodies[last.body] if collides else "",
            is_met=any(one.truth.nearest_beam_mm <= step.stop_mm for one in in_time),
            outcomes=[_outcome(sensor, steps, step, collides) for sensor in SENSORS],
        )

    @property
    def text(self) -> str:
        """Summary in one line."""
        to = f" towards {self.obstacle}" if self.obstacle else ""
        stops = ", ".join(
            f"{one.sensor} {'none' if one.stop_mm is None else format(one.stop_mm, '.0f')}"
            for one in self.outcomes
        )
        return f"{self.name}: {len(self.steps)} steps{to}; clearance (mm) at the stop: {stops}"


def _outcome(
    sensor: str,
    steps: Sequence[StepRecord],
    step: DriveStep,
    collides: bool,
) -> Outcome:
    stops = [one for one in steps if (mm := one.answers[sensor]) is not None and mm <= step.stop_mm]
    braking_mm = step.brakes.distance_mm
    in_time = any(one.clearance_mm >= braking_mm for one in stops)
    smallest_mm = min((one.clearance_mm for one in steps), default=inf)
    if not stops:
        return Outcome(sensor, None, 0.0 if collides else smallest_mm, collides, false_stop=False)
    first_mm = stops[0].clearance_mm
    rest_mm = first_mm - braking_mm if isfinite(first_mm) else smallest_mm
    false_stop = first_mm > step.stop_mm + step.margin_mm
    return Outcome(sensor, first_mm, max(rest_mm, 0.0), collides and not in_time, false_stop)
