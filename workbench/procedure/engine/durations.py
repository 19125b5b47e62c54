"""How long what a session does takes: as measured in it, as sessions before it told, or by a guess."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean, median
from typing import Any

from workbench.model import event as ev
from workbench.model.captures import BOARD
from workbench.model.errors import BadInputError
from workbench.procedure.engine.plan import PlannedStep
from workbench.procedure.engine.prompts import SAFETY
from workbench.session.journal import read_journal
from workbench.session.manifest import MANIFEST

SESSIONS_USED = 5
"""So many of the latest sessions of a rig tell its pace."""
PRIOR_WEIGHT = 2
"""What other sessions told of a duration counts as so many measurements of this one's; a guess as none."""
LONG_PAUSE_FACTOR = 3
LOADED = frozenset({"exposing_s", "shot_s", "finishing_s"})
"""The first of these in a program's life takes longer: what computes it is loaded, or even compiled, then."""


@dataclass(frozen=True)
class StepDurations:
    """Means; of what a person does without what took `LONG_PAUSE_FACTOR` times as long as usual."""

    placing_s: float = 60.0
    """From the end of one placement to the target's standing at the next."""
    exposing_s: float = 3.0
    """Setting the exposure for a placement."""
    shot_s: float = 1.0
    """One capture, with storing it, finding its spots and working out a range."""
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
        if step.captures:
            each = self.placing_s + self.exposing_s + self.finishing_s
            return step.placements * each + step.captures * self.shot_s
        guess_s = step.placements * self.placing_s if step.placements else step.default_duration_s
        return self.without_shots_s.get(step.title, guess_s)


def learn_durations(sessions: Path, rig: str) -> StepDurations:
    """The pace of the latest sessions of `rig`; guesses where there are none."""
    meter = DurationMeter()
    used = 0
    for manifest in sorted(sessions.glob(f"*/{MANIFEST}"), reverse=True):
        if used == SESSIONS_USED:
            break
        try:
            records = list(read_journal(manifest.parent))
        except BadInputError:
            continue
        if records and isinstance(first := records[0].event, ev.SessionStarted) and first.rig == rig:
            used += 1
            for record in records:
                meter.take(record)
    return replace(meter.pace(StepDurations()), sessions=used)


class DurationMeter:
    """Measures durations between records that follow one another."""

    def __init__(self) -> None:
        self._told: dict[str, list[float]] = defaultdict(list)
        self._loading: dict[str, float] = {}
        """The first of each of `LOADED`, which tells of the others only where it is all that there is."""
        self._fresh = set(LOADED)
        """Of which the first is still to come."""
        self._steps: dict[str, list[float]] = defaultdict(list)
        """Steps without captures, by their titles."""
        self._title: str | None = None
        """Of such a step, while nothing but time has gone by in it."""
        self._since: ev.Record | None = None

    def pace(self, otherwise: StepDurations) -> StepDurations:
        """What was measured, together with `otherwise` where that was learned; the rest is as `otherwise`."""
        worth = PRIOR_WEIGHT if otherwise.sessions else 0
        told: dict[str, Any] = dict(self._loading)
        for name, values in self._told.items():
            usual = _usual(values) if name == "placing_s" else fmean(values)
            before = getattr(otherwise, name)
            weight = 0 if before is None else worth
            told[name] = (len(values) * usual + weight * (before or 0.0)) / (len(values) + weight)
        steps = {title: fmean(values) for title, values in self._steps.items()}
        # A session that captures without setting an exposure has a camera whose exposure is fixed.
        told |= {"exposing_s": 0.0} if "shot_s" in told and "exposing_s" not in told else {}
        return replace(otherwise, **told, without_shots_s={**otherwise.without_shots_s, **steps})

    def take(self, record: ev.Record) -> None:
        """Note what a record tells; nothing is told by what a stop tore apart."""
        match record.event:
            case ev.SessionStarted() | ev.SessionResumed():
                self._fresh = set(LOADED)
                self._since = None
            case ev.SetAside():
                self._since = None
            case ev.StepStarted() as e:
                self._since, self._title = record, e.title
            case ev.Answered() as e if self._title is None or e.key == SAFETY or e.answer.action == "skip":
                self._since = record  # not a step's own question: what comes begins only now
            case ev.TargetPlaced():
                self._note("placing_s", record)
                self._title = None
            case ev.ExposureSet():
                self._note("exposing_s", record)
            case ev.CaptureTaken() as e:
                self._title = None
                if e.lit_s is not None:
                    self._told["lit_s"].append(e.lit_s)
                if e.laser_id == BOARD:  # no spots are looked for
                    self._note("shot_s", record)
            case ev.SpotsFound():
                self._note("shot_s", record)
            case ev.PlacementFinished():
                if self._since is not None and isinstance(self._since.event, ev.SpotsFound | ev.CaptureTaken):
                    self._note("finishing_s", record)
                self._since = record
            case ev.StepFinished():
                if self._since is not None and self._title is not None:
                    self._steps[self._title].append(_seconds(self._since, record))
                self._since = self._title = None
            case _:
                pass

    def _note(self, name: str, end: ev.Record) -> None:
        """That something has taken from the last record until now; the next begins."""
        if self._since is not None:
            took = _seconds(self._since, end)
            if name in self._fresh:
                self._fresh.remove(name)
                self._loading[name] = took
            else:
                self._told[name].append(took)
        self._since = end


def _usual(values: Sequence[float]) -> float:
    """The mean, as sums of them are to be right; but somebody may go to lunch."""
    most = LONG_PAUSE_FACTOR * median(values)
    return fmean(value for value in values if value <= most)


def _seconds(start: ev.Record, end: ev.Record) -> float:
    return (end.time_ns - start.time_ns) / 1e9
