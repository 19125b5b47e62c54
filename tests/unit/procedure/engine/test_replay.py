"""Deterministic replay: events of before are matched, the first new one is appended."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.prompt import Answer
from workbench.model.target import Placement
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.session.journal import JOURNAL, Journal, read_journal

STARTED = ev.SessionStarted(session="s", rig="r", procedures=("p",))
STEP = ev.StepStarted(procedure="p", index=1, step="fit", title="Fit", shots=0)
DONE = ev.StepFinished(procedure="p", index=1, outcome="done")
SAFETY = ev.Answered(key="safety", question="?", answer=Answer())
CARD = ev.Answered(key="p.1", question="?", answer=Answer(value="grey"))
PLACED = ev.TargetPlaced(placement=Placement(key="a", standoff_mm=500.0))
WHOLE = ev.PlacementFinished(key="a")
RETRY = ev.SetAside(key="a", from_n=1, reason="snr", retry=True)
RESUMED = ev.SessionResumed(from_n=0, operator="B", command="resume", created="")


@contextmanager
def replay(folder: Path, events: Sequence[ev.Event]) -> Iterator[tuple[ReplayingJournal, list[ev.Record]]]:
    """A journal that holds `events`, resumed; the records that its consumer is shown."""
    with Journal(folder) as journal:
        for event in events:
            journal.append(event)
    reopened, before = Journal.reopen(folder)
    shown: list[ev.Record] = []
    with reopened:
        yield ReplayingJournal(reopened, [shown.append], before, RESUMED), shown


def lines(folder: Path) -> int:
    return len((folder / JOURNAL).read_text().splitlines())


def test_what_the_journal_has_is_shown_and_not_written_again(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, STEP]) as (recorder, shown):
        assert [recorder.emit(event).n for event in (STARTED, STEP)] == [0, 1]
        assert lines(tmp_path) == 2
        assert recorder.emit(DONE).n == 3
        assert [record.event.kind for record in shown][2:] == ["session_resumed", "step_finished"]
        assert lines(tmp_path) == 4
        (resumed,) = [r.event for r in shown if isinstance(r.event, ev.SessionResumed)]
        assert resumed.from_n == 2


def test_an_answer_settles_only_the_question_that_was_asked(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, STEP, CARD]) as (recorder, _):
        assert recorder.answer("p.1", "?") == recorder.answer("p.1") == CARD.answer
        assert recorder.answer("p.1", "another result?") is None


def test_from_the_first_difference_on_nothing_of_before_counts(tmp_path: Path) -> None:
    other = STEP.model_copy(update={"title": "Other"})
    with replay(tmp_path, [STARTED, STEP, DONE]) as (recorder, shown):
        for event in (STARTED, other, DONE):
            recorder.emit(event)
        (resumed,) = [r.event for r in shown if isinstance(r.event, ev.SessionResumed)]
        assert resumed.from_n == 1
        assert lines(tmp_path) == 3 + 3, "resumption, the other step and its end are new"


def test_confirmations_of_safety_are_passed_over(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, SAFETY, STEP]) as (recorder, shown):
        for event in (STARTED, STEP):
            recorder.emit(event)
        assert [record.event for record in shown] == [STARTED, SAFETY, STEP]
        assert recorder.answer("safety") is None


def test_answers_and_latency_of_before_are_known(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, CARD, ev.LatencyMeasured(frames=3)]) as (recorder, _):
        assert recorder.answer("p.1") == Answer(value="grey")
        assert recorder.latency == ev.LatencyMeasured(frames=3)
        recorder.forget("p.1")
        assert recorder.answer("p.1") is None


def test_only_whole_placements_are_served(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, PLACED, WHOLE]) as (recorder, _):
        group = recorder.complete_placement("a")
        assert group is not None
        assert group.placed == PLACED
        recorder.forget("a")
        assert recorder.complete_placement("a") is None
    (tmp_path / JOURNAL).unlink()
    with replay(tmp_path, [STARTED, PLACED]) as (recorder, _):
        assert recorder.complete_placement("a") is None


def test_retries_of_before_count(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, PLACED, RETRY]) as (recorder, _):
        assert (recorder.retries("a"), recorder.retries("b")) == (1, 0)
        recorder.emit(STARTED)
        recorder.emit(RETRY)
        assert recorder.retries("a") == 2


def test_another_session_is_refused(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, STEP]) as (recorder, shown):
        with pytest.raises(BadInputError, match="r2") as caught:
            recorder.emit(STARTED.model_copy(update={"rig": "r2"}))
        assert shown == []
        assert lines(tmp_path) == 2
    assert caught.value.exit_code == 2


def test_placements_taken_again_are_known_before_and_after_a_resumption(tmp_path: Path) -> None:
    first = ev.SetAside(key="p.1/300mm", from_n=1, reason="slipped")
    other = ev.SetAside(key="p.2/300mm", from_n=2, reason="other step")
    with replay(tmp_path, [STARTED, first]) as (recorder, _):
        recorder.emit(STARTED)
        second = first.model_copy(update={"key": "p.1/400mm"})
        for event in (second, other):
            recorder.emit(event)
        assert recorder.set_aside("p.1/") == [first, second]


def fails_once() -> ev.Consumer:
    """A consumer that fails at the first record."""
    failures = iter([ev.ConsumerFailedError("the recording", "disk full")])

    def consumer(record: ev.Record) -> None:
        if (failure := next(failures, None)) is not None:
            raise failure

    return consumer


INCIDENT = ev.Incident(of="the recording", message="disk full")


def test_a_consumer_that_fails_is_an_incident_in_the_journal(tmp_path: Path) -> None:
    shown: list[ev.Record] = []
    with Journal(tmp_path) as journal:
        recorder = ReplayingJournal(journal, [fails_once(), shown.append])
        for event in (STARTED, STEP):
            recorder.emit(event)
    assert [record.event for record in read_journal(tmp_path)] == [STARTED, INCIDENT, STEP]
    assert [record.event for record in shown] == [STARTED, INCIDENT, STEP]


def test_an_incident_among_replayed_events_is_journalled_with_the_next_new_one(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for event in (STARTED, STEP):
            journal.append(event)
    reopened, before = Journal.reopen(tmp_path)
    with reopened:
        recorder = ReplayingJournal(reopened, [fails_once()], before, RESUMED)
        for again in (STARTED, STEP, DONE):
            recorder.emit(again)
    events = [record.event for record in read_journal(tmp_path)]
    assert events == [STARTED, STEP, RESUMED.model_copy(update={"from_n": 2}), INCIDENT, DONE]


def test_a_resumed_session_passes_an_incident_over(tmp_path: Path) -> None:
    with replay(tmp_path, [STARTED, INCIDENT, STEP]) as (recorder, shown):
        for event in (STARTED, STEP):
            recorder.emit(event)
        assert [record.event for record in shown] == [STARTED, INCIDENT, STEP]
        assert lines(tmp_path) == 3


def test_the_end_of_a_session_stays_its_last_record(tmp_path: Path) -> None:
    end = ev.SessionFinished(exit_code=0, message="done")
    with Journal(tmp_path) as journal:
        ReplayingJournal(journal, [fails_once()]).emit(end)
    assert [record.event for record in read_journal(tmp_path)] == [end]
