"""Decisions of repairs, read from the records."""

from __future__ import annotations

from workbench.model import event as ev
from workbench.model.target import Placement
from workbench.session.repairs import repairs_of
from workbench.session.state import effective, placement_captures, replaced_captures

A, B = "p.1/100mm", "p.1/200mm"


def repaired(n: int, **decisions: object) -> ev.Record:
    event = ev.SessionRepaired.model_validate(
        {"operator": "o", "command": "c", "created": "t", "reason": f"r{n}"} | decisions
    )
    return ev.Record(n=n, time_ns=n, event=event)


def record(n: int, event: ev.Event) -> ev.Record:
    return ev.Record(n=n, time_ns=n, event=event)


def test_of_two_decisions_about_a_placement_the_later_counts() -> None:
    out, back = repaired(5, leave_out=(A, B)), repaired(9, restore=(A,), recapture=(B,))
    assert repairs_of([out]).left_out == {A: "r5", B: "r5"}
    assert repairs_of([out, back]).left_out == {}
    assert repairs_of([back, out]).left_out == {A: "r5", B: "r5"}


def test_answers_before_a_placement_is_asked_again_do_not_count() -> None:
    found = repairs_of([repaired(5, recapture=(A,)), repaired(7, restore=(B,))])
    assert [found.counts(A, n) for n in (4, 5, 6)] == [False, False, True]
    assert [found.counts(f"{B}/limit", n) for n in (6, 7, 8)] == [False, False, True]
    assert found.counts("p.1/1000mm", 0)


def test_attempts_and_added_standoffs_add_up() -> None:
    found = repairs_of(
        [repaired(1, recapture=(A,), add_mm=(300.0,)), repaired(2, recapture=(A, B), add_mm=(50.0,))]
    )
    assert found.attempts == {A: 2, B: 1}
    assert found.added_mm == [300.0, 50.0]


def test_a_calibration_is_accepted_by_the_last_repair_alone() -> None:
    assert repairs_of([repaired(1, leave_out=(A,))]).accepted_because is None
    assert repairs_of([repaired(1, accept=True), repaired(2, leave_out=(A,))]).accepted_because is None


def test_captures_before_a_recapture_do_not_count_and_those_after_it_do() -> None:
    placed = ev.TargetPlaced(placement=Placement(key=A, standoff_mm=100.0), by="person")
    captured = [record(0, placed), record(1, ev.PlacementFinished(key=A))]
    assert placement_captures(captured)[A].complete
    again = [*captured, repaired(2, recapture=(A,))]
    assert placement_captures(again) == {}
    assert placement_captures([*again, record(3, placed), record(4, ev.PlacementFinished(key=A))])[A].complete
    assert placement_captures([*captured, repaired(2, leave_out=(A,))])[A].complete


def placed(n: int, attempt: int = 1) -> list[ev.Record]:
    event = ev.TargetPlaced(placement=Placement(key=A, standoff_mm=100.0, attempt=attempt), by="person")
    return [record(n, event), record(n + 1, ev.PlacementFinished(key=A))]


def test_a_restored_placement_has_the_captures_before_the_last_recapture() -> None:
    records = [*placed(0), repaired(2, recapture=(A,)), *placed(3, 2)]
    assert replaced_captures(records)[A].placed.placement.attempt == 1
    back = [*records, repaired(5, restore=(A,))]
    assert placement_captures(back)[A].placed.placement.attempt == 1
    assert placement_captures(back)[A].complete
    assert replaced_captures(back)[A].placed.placement.attempt == 2
    forth = [*back, repaired(6, restore=(A,))]
    assert placement_captures(forth)[A].placed.placement.attempt == 2


def test_restoring_a_placement_that_was_left_out_exchanges_no_captures() -> None:
    records = [*placed(0), repaired(2, recapture=(A,)), *placed(3, 2), repaired(5, leave_out=(A,))]
    assert placement_captures([*records, repaired(6, restore=(A,))])[A].placed.placement.attempt == 2


def test_replayed_captures_stay_complete_while_they_are_journalled_again() -> None:
    records = [*placed(0), repaired(2, restore=(A,)), placed(3)[0]]
    assert placement_captures(records)[A].complete
    assert not placement_captures([*placed(0), placed(2, 2)[0]])[A].complete


def test_a_resumption_makes_no_repair_void() -> None:
    started = record(0, ev.SessionStarted(session="s", rig="r", procedures=("p",)))
    repair = repaired(1, leave_out=(A,))
    resumed = record(2, ev.SessionResumed(from_n=0, operator="o", command="c", created="t"))
    assert effective([started, repair, resumed]) == [repair, resumed]
