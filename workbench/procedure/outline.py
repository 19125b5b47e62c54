"""What a plan amounts to before it runs: steps, placements, shots, and how long they take."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import singledispatch
from pathlib import Path
from statistics import fmean, median
from typing import Any

from workbench.model import event as ev
from workbench.model import procedure as pr
from workbench.model.errors import BadInputError
from workbench.model.procedure import Procedure
from workbench.model.rig import Rig
from workbench.procedure.steps import shots
from workbench.session.journal import read_journal
from workbench.session.manifest import MANIFEST

LEARNED_FROM = 5
"""So many of the latest sessions of a rig tell its pace."""


@dataclass(frozen=True)
class PlannedStep:
    """One step of a procedure."""

    procedure: str
    index: int
    title: str
    placements: int
    shots: int
    guess_s: float = 10.0
    """Where it takes no shots, and no session has told."""


@dataclass(frozen=True)
class Pace:
    """Over the sessions of a rig: of what a person does the median, of what the computer does the mean."""

    placing_s: float = 60.0
    """From the end of one placement to the target's standing at the next."""
    exposing_s: float = 3.0
    """Setting the exposure for a placement."""
    shot_s: float = 1.0
    """One capture, with storing it and finding its spots."""
    finishing_s: float = 1.0
    """From a placement's last capture to its end: limits, advice."""
    lit_s: float | None = None
    """Emission of one capture."""
    without_shots_s: Mapping[str, float] = field(default_factory=dict)
    """Steps without captures, by their titles."""
    sessions: int = 0
    """That it was learned from; 0: guesses."""

    def seconds(self, step: PlannedStep) -> float:
        """How long the step will take."""
        if step.shots:
            each = self.placing_s + self.exposing_s + self.finishing_s
            return step.placements * each + step.shots * self.shot_s
        guess_s = step.placements * self.placing_s if step.placements else step.guess_s
        return self.without_shots_s.get(step.title, guess_s)


@singledispatch
def placements(step: object) -> int:
    """How many times a step has the target placed: 0 but for steps that say otherwise."""
    return 0


@placements.register
def _(step: pr.CaptureGridStep) -> int:
    return len(step.standoffs_mm)


@placements.register
def _(step: pr.CaptureBoardStep) -> int:
    return len(step.placings)


@placements.register
def _(step: pr.AccuracyTrialStep) -> int:
    return len(step.standoffs_mm)


@placements.register
def _(step: pr.PlaceTargetStep) -> int:
    return 1


@singledispatch
def guess_s(step: object) -> float:
    """How long a step without shots may take where no session has told: computing, as a rule."""
    return 10.0


@guess_s.register
def _(step: pr.MessageStep) -> float:
    return 0.0


@guess_s.register
def _(step: pr.ConfirmStep | pr.AskStep) -> float:
    return 30.0


@guess_s.register
def _(step: pr.WarmUpStep) -> float:
    return 0.1 * step.frames  # 30 frames a second, two of three too old


def outline(procedures: Sequence[Procedure], rig: Rig) -> list[PlannedStep]:
    """Every step of every procedure, in order."""
    return [
        PlannedStep(procedure.procedure, index, step.title, placements(step), shots(step, rig), guess_s(step))
        for procedure in procedures
        for index, step in enumerate(procedure.steps, start=1)
    ]


def learn_pace(sessions: Path, rig: str) -> Pace:
    """The pace of the latest sessions of `rig`; guesses where there are none."""
    meter = PaceMeter()
    used = 0
    for manifest in sorted(sessions.glob(f"*/{MANIFEST}"), reverse=True):
        if used == LEARNED_FROM:
            break
        try:
            records = list(read_journal(manifest.parent))
        except BadInputError:
            continue
        if records and isinstance(first := records[0].event, ev.SessionStarted) and first.rig == rig:
            used += 1
            for record in records:
                meter.take(record)
    return meter.pace(Pace(sessions=used))


class PaceMeter:
    """Measures durations between records that follow one another."""

    def __init__(self) -> None:
        self._told: dict[str, list[float]] = defaultdict(list)
        self._steps: dict[str, list[float]] = defaultdict(list)
        """Steps without captures, by their titles."""
        self._since: ev.Record | None = None

    def pace(self, otherwise: Pace) -> Pace:
        """So far; what was not measured is as `otherwise`."""
        told: dict[str, Any] = {
            name: median(values) if name == "placing_s" else fmean(values)
            for name, values in self._told.items()
        }
        steps = {title: fmean(values) for title, values in self._steps.items()}
        # A session that captures without setting an exposure has a camera whose exposure is fixed.
        told |= {"exposing_s": 0.0} if "shot_s" in told and "exposing_s" not in told else {}
        return replace(otherwise, **told, without_shots_s={**otherwise.without_shots_s, **steps})

    def take(self, record: ev.Record) -> None:
        """Note what a record tells; nothing is told by what a stop tore apart."""
        since = self._since
        match record.event:
            case ev.StepStarted():
                self._since = record
            case ev.PlacementFinished():
                if since is not None and isinstance(since.event, ev.CaptureTaken):
                    self._told["finishing_s"].append(_seconds(since, record))
                self._since = record
            case ev.SessionResumed() | ev.SetAside():
                self._since = None
            case ev.TargetPlaced() if since is not None:
                self._told["placing_s"].append(_seconds(since, record))
                self._since = record
            case ev.ExposureSet() if since is not None:
                self._told["exposing_s"].append(_seconds(since, record))
                self._since = record
            case ev.CaptureTaken(lit_s=lit_s) if since is not None:
                self._told["shot_s"].append(_seconds(since, record))
                self._since = record
                if lit_s is not None:
                    self._told["lit_s"].append(lit_s)
            case ev.StepFinished() if since is not None:
                if isinstance(since.event, ev.StepStarted):
                    self._steps[since.event.title].append(_seconds(since, record))
                self._since = None
            case _:
                pass


class Forecast:
    """How far a session is, and how long it will still take."""

    def __init__(self, steps: Sequence[PlannedStep], otherwise: Pace) -> None:
        self._steps, self._otherwise = list(steps), otherwise
        self._meter = PaceMeter()
        self._step = -1
        self._placed = self._shots = 0

    def take(self, record: ev.Record) -> None:
        """Note what a record tells."""
        self._meter.take(record)
        match record.event:
            case ev.StepStarted():
                self._step += 1
                self._placed = self._shots = 0
            case ev.TargetPlaced():
                self._placed += 1
            case ev.CaptureTaken():
                self._shots += 1
            case _:
                pass

    @property
    def done(self) -> int:
        """The part under way, counted from 1: a placement, or a step without one."""
        return sum(max(step.placements, 1) for step in self._steps[: self._step]) + max(self._placed, 1)

    @property
    def total(self) -> int:
        """Of how many."""
        return sum(max(step.placements, 1) for step in self._steps)

    @property
    def seconds_left(self) -> float:
        """By the pace of this session as far as it goes, by that of others for the rest."""
        pace = self._meter.pace(self._otherwise)
        step = self._steps[self._step]
        under_way = replace(
            step,
            placements=max(step.placements - self._placed, 0),
            shots=max(step.shots - self._shots, 0),
        )
        here = pace.seconds(under_way) if under_way.shots or not step.shots else 0.0
        return here + sum(pace.seconds(later) for later in self._steps[self._step + 1 :])


def _seconds(start: ev.Record, end: ev.Record) -> float:
    return (end.time_ns - start.time_ns) / 1e9
