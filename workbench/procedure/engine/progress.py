"""Progress of a session: placements done, and estimate of the time left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.model import event as ev
from workbench.procedure.engine.durations import DurationMeter, StepDurations
from workbench.procedure.engine.plan import PlannedStep


class TimeLeft:
    """Estimate of the time left, from durations of this session and, for the rest, of earlier ones."""

    def __init__(self, steps: Sequence[PlannedStep], otherwise: StepDurations) -> None:
        self._steps, self._otherwise = list(steps), otherwise
        self._meter = DurationMeter()
        self._step = -1
        self._visited: dict[str, int] = {}
        """Placements of this step by key, including skipped ones, with their captures so far."""
        self._here: str | None = None
        """Key of the placement under way."""
        self._exposed = False

    def take(self, record: ev.Record) -> None:
        """Update the progress with a record."""
        self._meter.take(record)
        match record.event:
            case ev.StepStarted():
                self._step += 1
                self._visited, self._here = {}, None
            case ev.TargetPlaced(placement=placement):
                self._visited[placement.key] = 0
                self._here, self._exposed = placement.key, False
            case ev.ExposureSet():
                self._exposed = True
            case ev.CaptureTaken() as e if e.placement_key in self._visited:
                self._visited[e.placement_key] += 1
            case ev.PlacementFinished():
                self._here = None
            case ev.SetAside() as e:
                self._visited.pop(e.key, None)
                self._here = None
            case ev.Answered() as e if e.answer.action == "skip":
                self._visited[e.key] = 0
            case _:
                pass

    @property
    def done(self) -> int:
        """Number of placements done, including the one under way and skipped ones."""
        return sum(step.placements for step in self._steps[: self._step]) + len(self._visited)

    @property
    def total(self) -> int:
        """Number of placements of the session."""
        return sum(step.placements for step in self._steps)

    @property
    def seconds_left(self) -> float:
        """Estimated time from the last record to the end of the session."""
        durations = self._meter.durations(self._otherwise)
        step = self._steps[self._step]
        remaining = step.placements - len(self._visited)
        each = step.captures // max(step.placements, 1)
        rest = replace(step, placements=remaining, captures=remaining * each)
        seconds = durations.seconds(rest) if remaining or not step.placements else 0.0
        if self._here is not None and step.captures:
            captures = each - min(self._visited[self._here], each)
            seconds += captures * durations.capture_s + durations.finishing_s
            seconds += 0.0 if self._exposed else durations.exposing_s
        return seconds + sum(durations.seconds(later) for later in self._steps[self._step + 1 :])
