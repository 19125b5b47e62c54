"""Deterministic replay: a resumed session runs its procedures again over its own journal.

Events already in the journal are matched; from the first new one on, events are appended. Captures of
complete placements are read from disk, and all results are computed again from the frames.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import TypeGuard

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.prompt import Answer
from workbench.procedure.engine.prompts import SAFETY
from workbench.session.journal import Journal
from workbench.session.repairs import repairs_of
from workbench.session.state import PlacementCaptures, effective, placement_captures, safe_part


class ReplayingJournal:
    """Appends new events to the journal and passes the records of all events to the consumers."""

    def __init__(
        self,
        journal: Journal,
        consumers: Sequence[ev.Consumer],
        before: Sequence[ev.Record] = (),
        resumed: ev.SessionResumed | None = None,
        on_resumed: Callable[[], None] | None = None,
    ) -> None:
        """Create a recorder.

        Args:
            journal: open journal.
            consumers: receivers of every record, replayed ones first.
            before: records of the session so far; empty for a new session.
            resumed: event that is journalled before the first new one of a resumed session.
            on_resumed: called when `resumed` is on disk: what it accepts must not count before it.
        """
        self._journal, self._consumers = journal, consumers
        self.repairs = repairs_of(before)
        """Decisions of the session's repairs."""
        self._kept = deque(safe_part(before))
        self._from_n = 0
        self._resumed = resumed if before else None
        self._on_resumed = on_resumed
        self._incidents: list[ev.Incident] = []
        """Incidents to journal with the next new event; replayed events have no place for them."""
        self._complete = {
            key: captures for key, captures in placement_captures(before).items() if captures.complete
        }
        """Complete placements by key, which are not captured again."""
        self._answers = {
            r.event.key: r.event
            for r in self._kept
            if isinstance(r.event, ev.Answered) and self.repairs.counts(r.event.key, r.n)
        }
        self._set_aside = [r.event for r in effective(before) if isinstance(r.event, ev.SetAside)]
        self._retries = Counter(
            r.event.key for r in before if _is_retry(r.event) and self.repairs.counts(r.event.key, r.n)
        )
        measured = [e for e in (r.event for r in self._kept) if isinstance(e, ev.LatencyMeasured)]
        self.latency = measured[-1] if measured else None
        """Latency as measured before the session ended early; None if it was not measured."""

    def emit(self, event: ev.Event) -> ev.Record:
        """Journal an event unless it is replayed, then pass its record to every consumer.

        Raises:
            StoppedError: the journal cannot be written.
            BadInputError: the journal began with other procedures, another rig or another session name.
        """
        if isinstance(event, ev.SetAside):
            self._set_aside.append(event)
        if _is_retry(event):
            self._retries[event.key] += 1
        self._show_notes()
        if self._kept and self._kept[0].event == event:
            return self._show(self._kept.popleft())
        if self._kept and isinstance(event, ev.SessionStarted):
            raise BadInputError(
                f"session {event.session}: expected {_what(self._kept[0].event)}, as at its start, got"
                f" {_what(event)}; run these in a new session"
            )
        if self._kept and isinstance(event, ev.SessionFinished) and event.exit_code != 0:
            # The resumed session ended before any new event: all earlier records stay valid.
            self._from_n = self._kept[-1].n + 1
        for record in self._kept:
            if isinstance(record.event, ev.SessionRepaired):
                self._pass_on(record)
        self._kept.clear()
        self._journal_resumption()
        self._journal_incidents()
        record = self._show(self._journal.append(event))
        if not isinstance(event, ev.SessionFinished):  # the last record of a session
            self._journal_incidents()
        return record

    def complete_placement(self, key: str) -> PlacementCaptures | None:
        """Captures at a placement that was complete before the resumption and counts; None for others."""
        return None if key in self.repairs.left_out else self._complete.get(key)

    @property
    def complete_captures(self) -> list[ev.CaptureTaken]:
        """Captures at the placements that were complete before the resumption and count."""
        complete = (one for key, one in self._complete.items() if key not in self.repairs.left_out)
        return [capture for one in complete for capture in one.captures.values()]

    def retries(self, key: str) -> int:
        """Number of retries of a placement by limits in this session, including before resumptions."""
        return self._retries[key]

    def set_aside(self, prefix: str) -> list[ev.SetAside]:
        """Placements by the beginning of their key that were captured again or skipped in this session."""
        return [event for event in self._set_aside if event.key.startswith(prefix)]

    def answer(self, key: str, question: str | None = None) -> Answer | None:
        """Answer that was given before the session ended early, or by a repair; None if there is none.

        Args:
            key: key of the prompt or the placement.
            question: the question as it is now, which an answer to another one does not settle: a repair may
                have changed the result that it is about. None: any.
        """
        if (reason := self.repairs.left_out.get(key)) is not None:
            return Answer(action="skip", reason=reason)
        given = self._answers.get(key)
        if given is None or key == SAFETY or question not in {None, given.question}:
            return None
        return given.answer

    def forget(self, key: str) -> None:
        """Drop captures and answers of a placement that is captured again."""
        self._complete.pop(key, None)
        self._answers = {k: e for k, e in self._answers.items() if k != key and not k.startswith(f"{key}/")}

    def _show_notes(self) -> None:
        """Pass on records that no step emits again: resumptions, repairs, repetitions, incidents, safety."""
        while self._kept and _is_note(self._kept[0].event):
            self._show(self._kept.popleft())

    def _show(self, record: ev.Record) -> ev.Record:
        self._from_n = record.n + 1
        return self._pass_on(record)

    def _pass_on(self, record: ev.Record) -> ev.Record:
        for consumer in self._consumers:
            try:
                consumer(record)
            except ev.ConsumerFailedError as error:
                self._incidents.append(error.incident)
        return record

    def _journal_resumption(self) -> None:
        if self._resumed is None:
            return
        record = self._journal.append(self._resumed.model_copy(update={"from_n": self._from_n}))
        self._resumed = None
        if self._on_resumed is not None:
            self._on_resumed()
        self._show(record)

    def _journal_incidents(self) -> None:
        while self._incidents:
            self._show(self._journal.append(self._incidents.pop(0)))


def _what(started: ev.Event) -> str:
    if not isinstance(started, ev.SessionStarted):
        return started.kind
    return f"{', '.join(started.procedures)} on {started.rig} in {started.session}"


def _is_retry(event: ev.Event) -> TypeGuard[ev.SetAside]:
    return isinstance(event, ev.SetAside) and event.retry


def _is_note(event: ev.Event) -> bool:
    notes = ev.SessionResumed | ev.SessionRepaired | ev.SetAside | ev.Incident
    return isinstance(event, notes) or (isinstance(event, ev.Answered) and event.key == SAFETY)
