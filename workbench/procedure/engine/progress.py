"""How far a session is, and how long it will still take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.model import event as ev
from workbench.procedure.engine.durations import DurationMeter, StepDurations
from workbench.procedure.engine.plan import PlannedStep


class TimeLeft:
    """By the pace of this session as far as it goes, by that of others for the rest."""

    def __init__(self, steps: Sequence[PlannedStep], otherwise: StepDurations) -> None:
        self._steps, self._otherwise = list(steps), otherwise
        self._meter = DurationMeter()
        self._step = -1
        self._visited: dict[str, int] = {}
        """Placements of this step, those left out too, with the shots that each took so far."""
        self._here: str | None = None
        """The one under way."""
        self._exposed = False

    def take(self, record: ev.Record) -> None:
        """Note what a record tells."""
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
        """Placements that are dealt with, the one under way included."""
        return sum(step.placements for step in self._steps[: self._step]) + len(self._visited)

    @property
    def total(self) -> int:
        """Of how many."""
        return sum(step.placements for step in self._steps)

    @property
    def seconds_left(self) -> float:
        """From the last record to the end of the session."""
        pace = self._meter.durations(self._otherwise)
        step = self._steps[self._step]
        ahead = step.placements - len(self._visited)
        each = step.captures // max(step.placements, 1)
        to_come = replace(step, placements=ahead, captures=ahead * each)
        here = pace.seconds(to_come) if ahead or not step.placements else 0.0
        if self._here is not None and step.captures:
            here += (each - min(self._visited[self._here], each)) * pace.capture_s + pace.finishing_s
            here += 0.0 if self._exposed else pace.exposing_s
        return here + sum(pace.seconds(later) for later in self._steps[self._step + 1 :])
