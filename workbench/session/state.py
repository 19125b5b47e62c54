"""State of a session from its records: valid records, complete placements, status."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Literal

from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, BadInputError, StoppedError
from workbench.session.journal import JOURNAL, is_running, read_journal
from workbench.session.manifest import MANIFEST


def effective(records: Iterable[ev.Record]) -> list[ev.Record]:
    """Valid records: all but those that a resumption or a repeated placement has made void.

    Repairs stay valid.
    """
    kept: list[ev.Record] = []
    for record in records:
        if isinstance(record.event, ev.SessionResumed | ev.SetAside):
            void = []
            while kept and kept[-1].n >= record.event.from_n:
                void.append(kept.pop())
            kept += [one for one in reversed(void) if isinstance(one.event, ev.SessionRepaired)]
        kept.append(record)
    return kept


@dataclass
class PlacementCaptures:
    """Captures at one placement."""

    placed: ev.TargetPlaced
    exposure: ev.ExposureSet | None = None
    captures: dict[str, ev.CaptureTaken] = field(default_factory=dict)
    """Captures by key."""
    complete: bool = False

    @property
    def frames(self) -> list[ev.FrameRef]:
        """All frames of the captures."""
        return [one for taken in self.captures.values() for one in (taken.on, taken.off) if one is not None]


def placement_captures(records: Iterable[ev.Record]) -> dict[str, PlacementCaptures]:
    """Latest captures of each placement by its key, complete or not.

    Frames stay valid when computed records become void: only `SetAside` and a repair discard captures.
    """
    return _Captures.of(records).found


def replaced_captures(records: Iterable[ev.Record]) -> dict[str, PlacementCaptures]:
    """Complete captures by the key of their placement that a repair has replaced last, to be restored."""
    return {key: earlier[-1] for key, earlier in _Captures.of(records).replaced.items() if earlier}


@dataclass
class _Captures:
    """Captures of all placements after some records."""

    found: dict[str, PlacementCaptures] = field(default_factory=dict)
    replaced: dict[str, list[PlacementCaptures]] = field(default_factory=dict)
    """Complete captures that repairs have replaced, the last one at the end."""
    left_out: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, records: Iterable[ev.Record]) -> _Captures:
        captures = cls()
        for record in records:
            captures.add(record.event)
        return captures

    def add(self, event: ev.Event) -> None:
        """Take the next event into account."""
        found = self.found
        match event:
            case ev.TargetPlaced(placement=placement):
                before = found.get(placement.key)
                # Replayed captures are journalled again; a kill in between must not make them incomplete.
                if before is None or not before.complete or before.placed != event:
                    found[placement.key] = PlacementCaptures(event)
            case ev.ExposureSet() if event.key in found:
                found[event.key].exposure = event
            case ev.CaptureTaken() if event.placement_key in found:
                found[event.placement_key].captures[event.key] = event
            case ev.PlacementFinished() if event.key in found:
                found[event.key].complete = True
            case ev.SetAside():
                found.pop(event.key, None)
            case ev.SessionRepaired():
                self._repair(event)
            case _:
                pass

    def _repair(self, event: ev.SessionRepaired) -> None:
        for key in event.recapture:
            self._replace(key)
        for key in event.restore:
            if key not in self.left_out and self.replaced.get(key):
                earlier = self.replaced[key].pop()
                self._replace(key)
                self.found[key] = earlier
        self.left_out |= set(event.leave_out)
        self.left_out -= {*event.recapture, *event.restore}

    def _replace(self, key: str) -> None:
        """Keep the present captures of a placement as those that were replaced last."""
        present = self.found.pop(key, None)
        if present is not None and present.complete:
            self.replaced.setdefault(key, []).append(present)


def safe_part(records: Sequence[ev.Record]) -> list[ev.Record]:
    """Valid records up to the placement that was under way when the session ended."""
    kept = [r for r in effective(records) if not isinstance(r.event, ev.SessionFinished)]
    for index in range(len(kept) - 1, -1, -1):
        event = kept[index].event
        if isinstance(event, ev.PlacementFinished):
            break
        if isinstance(event, ev.TargetPlaced):
            return kept[:index]
    return kept


STATES: dict[int, Literal["finished", "stopped", "waiting"]] = {
    0: "finished",
    StoppedError.exit_code: "stopped",
    AnswerNeededError.exit_code: "waiting",
}
"""State by the exit code of the session; other codes mean `failed`."""


@dataclass(frozen=True)
class SessionStatus:
    """Status of a session."""

    session_dir: Path
    state: Literal["finished", "running", "stopped", "waiting", "failed", "interrupted", "damaged"]
    """`stopped` by a person, `waiting` for an answer to a prompt, `failed` by an error or a limit,
    `interrupted` by a kill or a power failure."""
    procedures: tuple[str, ...]
    captures: int
    why: str
    """Cause of the end in one line."""
    rig: str = ""
    calibration: str = ""
    """Outcome of the last fit in one line; empty without one."""
    trials: tuple[str, ...] = ()
    """Outcome of each finished trial in one line; of a verification its verdict."""

    @property
    def unfinished(self) -> bool:
        """Whether `workbench resume` can continue the session."""
        return self.state in {"stopped", "waiting", "failed", "interrupted"}


def session_statuses(sessions: Path) -> list[SessionStatus]:
    """Status of every session in a folder, ordered by name and therefore by time.

    Raises:
        BadInputError: there is no such folder.
    """
    if not sessions.is_dir():
        got = "a file" if sessions.exists() else "no such folder"
        raise BadInputError(f"{sessions}: expected a folder of sessions, got {got}")
    return [session_status(path.parent) for path in sorted(sessions.glob(f"*/{MANIFEST}"))]


def session_status(session_dir: Path) -> SessionStatus:
    """Status of one session."""
    try:
        exists = (session_dir / JOURNAL).exists()
        events = [r.event for r in effective(read_journal(session_dir))] if exists else []
    except BadInputError as error:
        return SessionStatus(session_dir, "damaged", (), 0, str(error))
    first, last = (events[0], events[-1]) if events else (None, None)
    procedures = first.procedures if isinstance(first, ev.SessionStarted) else ()
    captures = sum(isinstance(event, ev.CaptureTaken) for event in events)
    rig = first.rig if isinstance(first, ev.SessionStarted) else ""
    status = partial(
        SessionStatus,
        session_dir,
        procedures=procedures,
        captures=captures,
        rig=rig,
        calibration=_outcome_of_fit(events),
        trials=tuple(_outcomes_of_trials(events)),
    )
    if is_running(session_dir):
        return status(state="running", why="running in another program")
    if not isinstance(last, ev.SessionFinished):
        return status(state="interrupted", why="kill or power failure")
    why = (last.message.splitlines() or [""])[0]
    if last.exit_code == AnswerNeededError.exit_code:
        why = f"for an answer to {why.removeprefix('prompt ').partition(' -- ')[0]}"
    return status(state=STATES.get(last.exit_code, "failed"), why=why)


def _outcomes_of_trials(events: Sequence[ev.Event]) -> Iterator[str]:
    """Outcome of each trial, by the name of its step."""
    last = {event.trial: event for event in events if isinstance(event, ev.TrialFinished)}
    steps = [event for event in events if isinstance(event, ev.StepFinished)]
    outcomes = {f"{one.procedure}.{one.index}": one.outcome for one in steps}
    for name, trial in last.items():
        verdict = trial.verification
        outcome = outcomes.get(name, "") if verdict is None else verdict.text
        if outcome:
            yield f"{name}: {outcome}"


def _outcome_of_fit(events: Sequence[ev.Event]) -> str:
    """Outcome of the last fit: that of its step if it is accepted."""
    outcome = ""
    fitted = False
    for event in events:
        if isinstance(event, ev.FitFinished):
            outcome, fitted = f"{event.verdict}: rms {event.rms_px:.3f} px", True
        elif isinstance(event, ev.StepFinished) and fitted:
            outcome, fitted = event.outcome, False
    return outcome
