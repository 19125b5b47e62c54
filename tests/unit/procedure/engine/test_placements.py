"""Placements of the target: asked for, worked at, repeated, left out, served from disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Running, Scripted, running
from workbench.model.event import Answered, SetAside, TargetPlaced
from workbench.model.prompt import Answer, Prompt
from workbench.model.target import Placement
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.placements import RetakeError, settle, visit_placements
from workbench.procedure.engine.step import flat_placement

PLACEMENTS = [flat_placement("p.1", mm) for mm in (400.0, 500.0, 600.0)]
KEYS = [placement.key for placement in PLACEMENTS]
SKIP = Answer(action="skip", reason="no room")
REDO = Answer(action="redo", reason="it slipped")


def visit(session: Running, done: list[str]) -> list[str]:
    """Visits without captures, so without an exposure to set."""

    def work(placement: Placement) -> str:
        done.append(placement.key)
        return placement.key

    return visit_placements(session.context, PLACEMENTS, work, lights=False)


def test_every_placement_is_asked_for_placed_and_finished(tmp_path: Path) -> None:
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        assert visit(session, []) == KEYS
        assert operator.keys == ["safety", *KEYS]
        assert session.kinds == ["answered", *["target_placed", "placement_finished"] * 3]


def test_the_standoff_that_the_ruler_shows_is_the_placements(tmp_path: Path) -> None:
    with running(tmp_path, operator=Scripted({KEYS[0]: [Answer(value=402.5)]})) as session:
        visit(session, [])
        placed = [event.placement for event in session.events if isinstance(event, TargetPlaced)]
    assert [one.key for one in placed] == KEYS
    assert [one.standoff_mm for one in placed] == [402.5, 500.0, 600.0]


def test_a_skipped_placement_is_not_worked_at(tmp_path: Path) -> None:
    done: list[str] = []
    with running(tmp_path, operator=Scripted({KEYS[1]: [SKIP]})) as session:
        assert visit(session, done) == done == [KEYS[0], KEYS[2]]
        skipped = [event for event in session.events if isinstance(event, Answered) and event.key == KEYS[1]]
    assert [event.answer for event in skipped] == [SKIP]


def test_redo_captures_the_placement_before_again(tmp_path: Path) -> None:
    done: list[str] = []
    operator = Scripted({KEYS[1]: [REDO]})
    with running(tmp_path, operator=operator) as session:
        assert visit(session, done) == KEYS
        first = next(r for r in session.records if isinstance(r.event, TargetPlaced))
        (aside,) = [event for event in session.events if isinstance(event, SetAside)]
    assert done == [KEYS[0], *KEYS]
    assert (aside.key, aside.from_n, aside.retry, aside.left_out) == (KEYS[0], first.n, False, False)
    assert operator.keys == ["safety", KEYS[0], KEYS[1], *KEYS]


def test_work_that_asks_for_it_is_repeated_without_another_prompt(tmp_path: Path) -> None:
    operator = Scripted()
    tried: list[str] = []

    def work(placement: Placement) -> int:
        tried.append(placement.key)
        pairs = capture_lasers(session.context, placement, 1)
        if len(tried) == 1:
            raise RetakeError("snr", by_limit=True)
        return pairs

    with running(tmp_path, operator=operator) as session:
        assert visit_placements(session.context, PLACEMENTS[:1], work) == [2]
        (aside,) = [event for event in session.events if isinstance(event, SetAside)]
        for folder in ("frames", "set-aside/1"):
            frames = (session.context.session_dir / folder / KEYS[0] / "L1").iterdir()
            assert sorted(path.name for path in frames) == ["00-off.png", "00-on.png"]
        assert len(session.context.captures) == 2, "those of the second try"
    assert (aside.retry, aside.reason) == (True, "snr")
    assert operator.keys == ["safety", KEYS[0]]


def test_a_placement_left_out_at_a_limit_gives_no_result(tmp_path: Path) -> None:
    prompt = Prompt(f"{KEYS[0]}/L1/snr", "Keep?", may={"skip": "leave it out"})

    def work(placement: Placement) -> str:
        if placement.key == KEYS[0]:
            settle(session.context, prompt, "snr")
        return placement.key

    with running(tmp_path, operator=Scripted({prompt.key: [SKIP]})) as session:
        assert visit_placements(session.context, PLACEMENTS[:2], work, lights=False) == [KEYS[1]]
        (aside,) = [event for event in session.events if isinstance(event, SetAside)]
    assert (aside.key, aside.left_out, aside.reason) == (KEYS[0], True, "no room")


@pytest.mark.parametrize("whole", [True, False])
def test_a_resumed_session_repeats_what_was_not_whole(tmp_path: Path, whole: bool) -> None:
    def work(placement: Placement) -> float:
        capture_lasers(session.context, placement, 1)
        (spot,) = session.context.findings[f"{placement.key}/L1/00"].spots
        return spot.u_px

    with running(tmp_path) as session:
        first = visit_placements(session.context, PLACEMENTS[:2], work)
        records = list(session.records)
    (tmp_path / "s/journal.jsonl").unlink()
    operator = Scripted()
    with running(tmp_path, operator=operator, before=records if whole else records[:-1]) as session:
        assert visit_placements(session.context, PLACEMENTS[:2], work) == pytest.approx(first, abs=1e-9)
        ended_ns = records[-1].time_ns
        new = [taken for taken in session.context.captures if taken.on.time_ns > ended_ns]
    assert operator.keys == ([] if whole else ["safety", KEYS[1]])
    assert {taken.placement_key for taken in new} == (set() if whole else {KEYS[1]})


def captured(session: Running, placements: list[Placement]) -> list[tuple[str, int, int]]:
    """Key, time and part of each capture at the placements, two in each."""
    visit_placements(
        session.context, placements, lambda placement: capture_lasers(session.context, placement, 1)
    )
    return [(one.key, one.time_ns, one.part) for one in session.context.captures]


@pytest.mark.parametrize("records", [3, 12])
def test_a_virtual_session_has_the_same_times_after_a_stop(tmp_path: Path, records: int) -> None:
    """Stopped within its first placement and within its second."""
    with running(tmp_path) as session:
        whole = captured(session, PLACEMENTS)
        before = session.records[:records]
    (tmp_path / "s/journal.jsonl").unlink()
    with running(tmp_path, before=before) as session:
        assert captured(session, PLACEMENTS) == whole
    assert {part for _, _, part in whole} == {0}
    assert [time_ns for _, time_ns, _ in whole] == sorted({time_ns for _, time_ns, _ in whole})


def test_a_placement_captured_again_follows_the_captures_that_count(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        whole = captured(session, PLACEMENTS)
    (tmp_path / "s/journal.jsonl").unlink()
    with running(tmp_path, operator=Scripted({KEYS[1]: [REDO]})) as session:
        assert captured(session, PLACEMENTS) == whole


@pytest.mark.parametrize(("complete", "part"), [(1, 1), (0, 0)])
def test_a_resumed_session_of_a_real_bench_begins_another_part(
    tmp_path: Path, complete: int, part: int
) -> None:
    with running(tmp_path) as session:
        captured(session, PLACEMENTS[:1])
        before = session.records if complete else session.records[:-1]
    (tmp_path / "s/journal.jsonl").unlink()
    with running(tmp_path, before=before, rests=False) as session:
        found = captured(session, PLACEMENTS[:2])
    assert [own for _, _, own in found] == [0, 0, part, part]
