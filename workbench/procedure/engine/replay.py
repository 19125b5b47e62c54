"""Deterministic replay: a resumed session runs its procedures again over its own journal.

Events already in the journal are matched, from the first new one on they are appended. Captures of whole
placements are read from the frames on disk; everything computed from them is computed again.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from typing import TypeGuard

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.prompt import Answer
from workbench.procedure.engine.prompts import SAFETY
from workbench.session.journal import Journal
from workbench.session.state import Group, groups, safe_part


class ReplayingJournal:
    """Appends new events to the journal, and shows the records of all events to the consumers."""

    def __init__(
        self,
        journal: Journal,
        consumers: Sequence[ev.Consumer],
        before: Sequence[ev.Record] = (),
        resumed: ev.SessionResumed | None = None,
    ) -> None:
        """Start, or go on after the records `before`; `resumed` is then written before anything new."""
        self._journal, self._consumers = journal, consumers
        self._kept = deque(safe_part(before))
        self._from_n = 0
        self._resumed = resumed if before else None
        self.whole = {key: group for key, group in groups(before).items() if group.whole}
        """Whole placements by key: they are not captured again."""
        self._answers = {
            e.key: e for e in (record.event for record in self._kept) if isinstance(e, ev.Answered)
        }

        self._retries = Counter(r.event.key for r in before if _is_retry(r.event))
        measured = [e for e in (r.event for r in self._kept) if isinstance(e, ev.LatencyMeasured)]
        self.latency = measured[-1].frames if measured else None
        """As measured before the session ended early."""

    def emit(self, event: ev.Event) -> ev.Record:
        """Write an event unless the journal has it, then show it to every consumer.

        Raises:
            StoppedError: the journal cannot be written.
            BadInputError: the session is another one.
        """
        if _is_retry(event):
            self._retries[event.key] += 1
        self._show_notes()
        if self._kept and self._kept[0].event == event:
            return self._show(self._kept.popleft())
        if self._kept and isinstance(event, ev.SessionStarted):
            raise BadInputError(
                f"session {event.session}: expected what it began with, {_what(self._kept[0].event)}, got"
                f" {_what(event)}; run these anew"
            )
        if self._kept and isinstance(event, ev.SessionFinished) and event.exit_code != 0:
            # It ended again before anything was new: what was there already still counts, all of it.
            self._from_n = self._kept[-1].n + 1
        self._kept.clear()
        if self._resumed is not None:
            resumed = self._resumed.model_copy(update={"from_n": self._from_n})
            self._resumed = None
            self._show(self._journal.append(resumed))
        return self._show(self._journal.append(event))

    def group(self, key: str) -> Group | None:
        """What is captured at a placement already, all of it."""
        return self.whole.get(key)

    def retries(self, key: str) -> int:
        """How often a limit has had a placement captured again in this session, resumptions included."""
        return self._retries[key]

    def answer(self, key: str) -> Answer | None:
        """What was answered before the session ended early."""
        given = self._answers.get(key)
        return None if given is None or key == SAFETY else given.answer

    def forget(self, key: str) -> None:
        """What is known of a placement counts no more: it is captured again."""
        self.whole.pop(key, None)
        self._answers = {k: e for k, e in self._answers.items() if k != key and not k.startswith(f"{key}/")}

    def _show_notes(self) -> None:
        """Pass over what no procedure tells: resumptions, repetitions, confirmations of safety."""
        while self._kept and _is_note(self._kept[0].event):
            self._show(self._kept.popleft())

    def _show(self, record: ev.Record) -> ev.Record:
        self._from_n = record.n + 1
        for consumer in self._consumers:
            consumer(record)
        return record


def _what(started: ev.Event) -> str:
    if not isinstance(started, ev.SessionStarted):
        return started.kind
    return f"{', '.join(started.procedures)} on {started.rig} in {started.session}"


def _is_retry(event: ev.Event) -> TypeGuard[ev.SetAside]:
    return isinstance(event, ev.SetAside) and event.retry


def _is_note(event: ev.Event) -> bool:
    return isinstance(event, ev.SessionResumed | ev.SetAside) or (
        isinstance(event, ev.Answered) and event.key == SAFETY
    )
