"""Step durations for the time-left estimate: measured, learned from the last sessions, or a default."""

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
"""Number of most recent sessions that durations are learned from."""
PRIOR_WEIGHT = 2
"""Weight of a duration learned from other sessions, in measurements of this one; a default has none."""
LONG_PAUSE_FACTOR = 3
"""A placement that takes this many medians is a break."""
LOADED = frozenset({"exposing_s", "capture_s", "finishing_s"})
"""Durations whose first occurrence in a process takes longer, as code is loaded or compiled then."""


@dataclass(frozen=True)
class StepDurations:
    """Mean durations; durations of a person exclude pauses longer than `LONG_PAUSE_FACTOR` medians."""

    placing_s: float = 60.0
    """From the end of one placement to the target being placed at the next."""
    exposing_s: float = 3.0
    """Setting the exposure at a placement."""
    capture_s: float = 1.0
    """One capture, including storage, search for spots and ranging."""
    finishing_s: float = 1.0
    """From a placement's last capture to its end: limits, advice."""
    lit_s: float | None = None
    """Emission of one capture; None if not measured."""
    without_captures_s: Mapping[str, float] = field(default_factory=dict)
    """Durations of steps without captures, by title."""
    sessions: int = 0
    """Number of sessions that the durations were learned from; 0: defaults."""

    def seconds(self, step: PlannedStep) -> float:
        """Expected duration of a step."""
        if step.captures:
            each = self.placing_s + self.exposing_s + self.finishing_s
            return step.placements * each + step.captures * self.capture_s
        default_s = step.placements * self.placing_s if step.placements else step.default_duration_s
        return self.without_captures_s.get(step.title, default_s)


def learn_durations(sessions: Path, rig: str) -> StepDurations:
    """Durations of the latest sessions of `rig`; defaults if there are none."""
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
    return replace(meter.durations(StepDurations()), sessions=used)


class DurationMeter:
    """Measures durations between consecutive records."""

    def __init__(self) -> None:
        self._measured: dict[str, list[float]] = defaultdict(list)
        self._loading: dict[str, float] = {}
        """First occurrence of each of `LOADED`, used only until there is another one."""
        self._fresh = set(LOADED)
        """Names whose first occurrence is still to come."""
        self._steps: dict[str, list[float]] = defaultdict(list)
        """Durations of steps without captures, by title."""
        self._title: str | None = None
        """Title of the present step, as long as it has no captures."""
        self._since: ev.Record | None = None

    def durations(self, otherwise: StepDurations) -> StepDurations:
        """Measured durations, averaged with `otherwise` if those were learned; `otherwise` for the rest."""
        prior_weight = PRIOR_WEIGHT if otherwise.sessions else 0
        measured: dict[str, Any] = dict(self._loading)
        for name, values in self._measured.items():
            mean = _mean_without_pauses(values) if name == "placing_s" else fmean(values)
            prior = getattr(otherwise, name)
            weight = 0 if prior is None else prior_weight
            measured[name] = (len(values) * mean + weight * (prior or 0.0)) / (len(values) + weight)
        steps = {title: fmean(values) for title, values in self._steps.items()}
        # Captures without an exposure event mean that the camera's exposure is fixed.
        measured |= {"exposing_s": 0.0} if "capture_s" in measured and "exposing_s" not in measured else {}
        return replace(otherwise, **measured, without_captures_s={**otherwise.without_captures_s, **steps})

    def take(self, record: ev.Record) -> None:
        """Measure the time of a record; durations cut short by an interruption are not counted."""
        match record.event:
            case ev.SessionStarted() | ev.SessionResumed():
                self._fresh = set(LOADED)
                self._since = None
            case ev.SetAside():
                self._since = None
            case ev.StepStarted() as e:
                self._since, self._title = record, e.title
            case ev.Answered() as e if self._title is None or e.key == SAFETY or e.answer.action == "skip":
                self._since = record  # not the step's own question: the next duration starts here
            case ev.TargetPlaced():
                self._note("placing_s", record)
                self._title = None
            case ev.ExposureSet():
                self._note("exposing_s", record)
            case ev.CaptureTaken() as e:
                self._title = None
                if e.lit_s is not None:
                    self._measured["lit_s"].append(e.lit_s)
                if e.laser_id == BOARD:  # no search for spots follows
                    self._note("capture_s", record)
            case ev.SpotsFound():
                self._note("capture_s", record)
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
        """Record the time since the last record as one duration of `name`."""
        if self._since is not None:
            took = _seconds(self._since, end)
            if name in self._fresh:
                self._fresh.remove(name)
                self._loading[name] = took
            else:
                self._measured[name].append(took)
        self._since = end


def _mean_without_pauses(values: Sequence[float]) -> float:
    """Mean of the values up to `LONG_PAUSE_FACTOR` medians. A median would bias the sum over placements."""
    most = LONG_PAUSE_FACTOR * median(values)
    return fmean(value for value in values if value <= most)


def _seconds(start: ev.Record, end: ev.Record) -> float:
    return (end.time_ns - start.time_ns) / 1e9
