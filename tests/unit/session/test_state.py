"""From a session's records to where it stands."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.prompt import Answer
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.session.journal import JOURNAL, Journal
from workbench.session.state import effective, placement_captures, safe_part, session_status, session_statuses

STARTED = ev.SessionStarted(session="s", rig="r", procedures=("p",))
STEP = ev.StepStarted(procedure="p", index=1, step="s", title="t", shots=0)


def placed(key: str) -> ev.TargetPlaced:
    return ev.TargetPlaced(placement=Placement(key=key, standoff_mm=500.0))


def taken(placement: str, key: str) -> ev.CaptureTaken:
    frame = ev.FrameRef(path="f", sha256="", time_ns=0)
    return ev.CaptureTaken(
        key=key,
        purpose="calibration",
        laser_id="L1",
        placement_key=placement,
        standoff_mm=500.0,
        repeat=0,
        on=frame,
    )


def whole(key: str) -> ev.PlacementFinished:
    return ev.PlacementFinished(key=key)


def aside(key: str, from_n: int) -> ev.SetAside:
    return ev.SetAside(key=key, from_n=from_n, reason="snr")


def numbered(*events: ev.Event) -> list[ev.Record]:
    return [ev.Record(n=n, time_ns=n, event=event) for n, event in enumerate(events)]


def test_what_was_set_aside_does_not_count() -> None:
    resumed = ev.SessionResumed(from_n=3, operator="", command="", created="")
    records = numbered(STARTED, STEP, placed("a"), taken("a", "a1"), resumed, taken("a", "a2"), aside("a", 2))
    assert [record.n for record in effective(records)] == [0, 1, 6]
    assert [record.n for record in effective(records[:-1])] == [0, 1, 2, 4, 5]


def test_a_group_is_the_latest_capture_of_its_placement() -> None:
    exposed = ev.ExposureSet(key="a", exposure=9.0, unit="us", peak=0.6, verdict="good", trials=3)
    records = numbered(
        placed("a"), exposed, taken("a", "a1"), whole("a"), placed("b"), taken("b", "b1"), aside("b", 4),
        placed("b"), taken("b", "b2"), placed("c"), taken("c", "c1"), aside("c", 9),
    )  # fmt: skip
    found = placement_captures(records)
    assert {key: list(group.captures) for key, group in found.items()} == {"a": ["a1"], "b": ["b2"]}
    assert {key: group.complete for key, group in found.items()} == {"a": True, "b": False}
    assert (found["a"].exposure, found["b"].exposure) == (exposed, None)


def test_the_safe_part_ends_before_the_placement_under_way() -> None:
    ended = ev.SessionFinished(exit_code=5, message="stopped")
    first: list[ev.Event] = [placed("a"), taken("a", "a1"), whole("a")]
    records = numbered(STARTED, *first, STEP, placed("b"), taken("b", "b1"), ended)
    assert [record.n for record in safe_part(records)] == [0, 1, 2, 3, 4]
    assert [record.n for record in safe_part(records[:5])] == [0, 1, 2, 3, 4]
    assert [record.n for record in safe_part(numbered(STARTED, placed("a")))] == [0]


def write(session: Path, *events: ev.Event) -> Path:
    session.mkdir(parents=True)
    (session / "session.yaml").write_text("format: 1\n")
    with Journal(session) as journal:
        for event in events:
            journal.append(event)
    return session


@pytest.mark.parametrize(
    ("exit_code", "state", "unfinished"),
    [
        (0, "finished", False),
        (5, "stopped", True),
        (6, "waiting", True),
        (3, "failed", True),
        (1, "failed", True),
        (None, "interrupted", True),
    ],
)
def test_a_session_stands_where_its_exit_code_says(
    tmp_path: Path, exit_code: int | None, state: str, unfinished: bool
) -> None:
    end = [] if exit_code is None else [ev.SessionFinished(exit_code=exit_code, message="first line\nsecond")]
    status = session_status(write(tmp_path / "s", STARTED, placed("a"), taken("a", "a1"), *end))
    assert (status.state, status.unfinished) == (state, unfinished)
    assert (status.procedures, status.captures) == (("p",), 1)
    assert "\n" not in status.why


def verified(valid: str) -> ev.TrialFinished:
    """A verification with this cell in its verdict."""
    columns = tuple(Column(key=key, name=key) for key in ("valid", "verdict"))
    table = Table(name="p.1-verdict", title="Verdict", columns=columns, rows=((valid, "p = 0.3"),))
    return ev.TrialFinished(trial="p.1", tables=(table,))


def test_the_results_of_trials_are_part_of_the_status(tmp_path: Path) -> None:
    finished = ev.StepFinished(procedure="p", index=2, outcome="bias 0.1 mm")
    accuracy = ev.TrialFinished(trial="p.2")
    status = session_status(write(tmp_path / "a", STARTED, verified("yes"), accuracy, finished))
    verification, other = status.trials
    assert other == "p.2: bias 0.1 mm"
    assert verification.startswith("p.1: ")
    refused = session_status(write(tmp_path / "b", STARTED, verified("NO")))
    assert refused.trials != (verification,)
    assert session_status(write(tmp_path / "c", STARTED)).trials == ()


def test_a_session_that_waits_names_the_open_prompt(tmp_path: Path) -> None:
    message = "prompt p.2: Which card? -- nobody answers"
    answered = ev.Answered(key="p.1", question="?", answer=Answer())
    ended = ev.SessionFinished(exit_code=6, message=message)
    assert session_status(write(tmp_path / "s", STARTED, answered, ended)).why.endswith("p.2: Which card?")


def test_a_session_whose_journal_is_open_is_running(tmp_path: Path) -> None:
    session = write(tmp_path / "s", STARTED)
    reopened, _ = Journal.reopen(session)
    with reopened:
        status = session_status(session)
        assert (status.state, status.unfinished) == ("running", False)
    assert session_status(session).state == "interrupted"


def test_a_damaged_journal_is_a_state_with_its_place(tmp_path: Path) -> None:
    session = write(tmp_path / "s", STARTED, STEP)
    path = session / JOURNAL
    path.write_text(path.read_text().replace('"index":1', '"index":"x"'))
    status = session_status(session)
    assert (status.state, status.unfinished) == ("damaged", False)
    assert f"{path}:2" in status.why


def test_sessions_are_listed_by_name(tmp_path: Path) -> None:
    for name in ("20260102-a", "20260101-b"):
        write(tmp_path / name, STARTED)
    (tmp_path / "no-session").mkdir()
    assert [status.session_dir.name for status in session_statuses(tmp_path)] == ["20260101-b", "20260102-a"]
    for path in (tmp_path / "none", tmp_path / "20260101-b/session.yaml"):
        with pytest.raises(BadInputError, match=str(path)) as caught:
            session_statuses(path)
        assert caught.value.exit_code == 2
