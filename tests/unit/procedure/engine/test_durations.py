"""Step durations: measured, learned, without breaks and first times."""

from __future__ import annotations

import pytest

from tests.support.records import SESSION, STEPS, exposed, finished, placed, records, shot, started
from workbench.model import event as ev
from workbench.model.prompt import Answer
from workbench.procedure.engine.durations import DurationMeter, StepDurations
from workbench.procedure.engine.plan import PlannedStep


def meter_of(*timed: tuple[float, ev.Event]) -> DurationMeter:
    meter = DurationMeter()
    for record in records(*timed):
        meter.take(record)
    return meter


def test_pace_is_what_was_measured() -> None:
    """The mean: sums are right."""
    pace = meter_of(*SESSION).durations(StepDurations(without_captures_s={"fit": 7.0}))
    assert pace.placing_s == 30.0
    assert pace.capture_s == pytest.approx((1 + 3) / 2), "the first was loading programs"
    assert pace.lit_s == pytest.approx(0.2)
    assert (pace.exposing_s, pace.finishing_s) == (0.0, 0.0), "this camera's exposure is fixed"
    assert pace.seconds(STEPS[1]) == 7.0


def test_a_break_tells_nothing_of_the_next_placing() -> None:
    """Somebody goes to lunch; others take twice as long as usual, and these count."""
    session: list[tuple[float, ev.Event]] = [(0, started(1, 4))]
    at = 0.0
    for n, took in enumerate((20.0, 30.0, 3600.0, 25.0, 50.0, 25.0)):
        at += took
        session.append((at, placed(f"{n}")))
    assert meter_of(*session).durations(StepDurations()).placing_s == pytest.approx(
        (20 + 30 + 25 + 50 + 25) / 5
    )


def test_a_plan_takes_as_long_as_the_session_that_told_it() -> None:
    """Nothing that a session does is left out: exposures, advice, each step without shots by itself."""
    fit = ev.StepStarted(procedure="p", index=2, step="fit", title="fit", shots=0)
    export = ev.StepStarted(procedure="p", index=3, step="export", title="export", shots=0)
    meter = meter_of(
        (0, started(1, 4)),
        (40, placed("a")),
        (44, exposed("a")),
        *shot(45, "a1", 0.5),
        *shot(46, "a2", 1.0),
        (51, ev.PlacementFinished(key="a")),
        (91, placed("b")),
        (95, exposed("b")),
        *shot(96, "b1", 0.5),
        *shot(97, "b2", 1.0),
        (101, ev.PlacementFinished(key="b")),
        (101, finished(1)),
        (101, fit),
        (131, finished(2)),
        (131, export),
        (132, finished(3)),
    )
    steps = [
        PlannedStep("p", 1, "t", 2, 4),
        PlannedStep("p", 2, "fit", 0, 0),
        PlannedStep("p", 3, "export", 0, 0),
    ]
    pace = meter.durations(StepDurations())
    assert sum(map(pace.seconds, steps)) == pytest.approx(132.0, rel=0.02)
    assert pace.seconds(PlannedStep("p", 1, "place", 1, 0)) == 40.0, "somebody has to place it"


def test_what_a_stop_tore_apart_tells_no_duration() -> None:
    resumed = ev.SessionResumed(from_n=1, operator="", command="", created="")
    meter = meter_of((0, started(1, 4)), (20, placed("a")), (9000, resumed), (9001, placed("a")))
    assert meter.durations(StepDurations()).placing_s == 20.0


def test_nor_does_a_question_that_comes_once() -> None:
    """Safety is confirmed before the first placing, and after a resumption; a skipped placement is none."""
    safety = ev.Answered(key="safety", question="?", answer=Answer())
    skip = ev.Answered(key="b", question="?", answer=Answer(action="skip", reason="no room"))
    meter = meter_of((0, started(1, 4)), (300, safety), (320, placed("a")), (620, skip), (640, placed("c")))
    assert meter.durations(StepDurations()).placing_s == 20.0
    kept = ev.Answered(key="a/L1/snr", question="Keep?", answer=Answer())
    asked = meter_of((0, started(1, 4)), *shot(1, "a1"), (300, kept), (301, ev.PlacementFinished(key="a")))
    assert asked.durations(StepDurations()).finishing_s == StepDurations().finishing_s, (
        "a limit that failed was asked about"
    )
    own = ev.StepStarted(procedure="p", index=1, step="ask", title="Which?", shots=0)
    answered = ev.Answered(key="p.1", question="Which?", answer=Answer(value="grey"))
    assert (
        meter_of((0, own), (30, answered), (30, finished(1)))
        .durations(StepDurations())
        .without_captures_s["Which?"]
        == 30.0
    )


def test_what_other_sessions_told_is_left_step_by_step() -> None:
    """One placing of 90 s does not make a session of half a minute each three times as long."""
    learned = StepDurations(placing_s=30.0, sessions=3)
    session: list[tuple[float, ev.Event]] = [(0, started(1, 4)), (90, placed("a"))]
    assert meter_of(*session).durations(learned).placing_s == pytest.approx((2 * 30 + 90) / 3)
    assert meter_of(*session).durations(StepDurations()).placing_s == 90.0, "a guess counts for nothing"
