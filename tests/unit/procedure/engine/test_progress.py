"""Placements done and time left of a session."""

from __future__ import annotations

import pytest

from tests.support.records import SESSION, STEPS, exposed, placed, records, shot, started
from workbench.model import event as ev
from workbench.model.prompt import Answer
from workbench.procedure.engine.durations import StepDurations
from workbench.procedure.engine.plan import PlannedStep
from workbench.procedure.engine.progress import TimeLeft


def test_what_is_compiled_for_the_first_capture_is_not_expected_again() -> None:
    """Two minutes for the first spots on a computer that has never found any; then 0.1 s."""
    session: list[tuple[float, ev.Event]] = [(0, started(1, 40)), (20, placed("a")), (21, exposed("a"))]
    session += shot(21.1, "a0", 120.0)
    for n in range(1, 20):
        session += shot(141 + n / 10, f"a{n}", 0.1)
    session.append((143.1, ev.PlacementFinished(key="a")))
    forecast = TimeLeft([PlannedStep("p", 1, "grid", 11, 220)], StepDurations())
    for record in records(*session):
        forecast.take(record)
    assert forecast.seconds_left == pytest.approx(10 * (20 + 1 + 20 * 0.1), rel=0.1)


def test_the_forecast_counts_placements_and_what_is_left() -> None:
    forecast = TimeLeft(STEPS, StepDurations())
    for record in records(*SESSION):
        forecast.take(record)
    assert (forecast.done, forecast.total) == (2, 3)
    # A placing and three shots of this step, and the fit.
    assert forecast.seconds_left == pytest.approx(30.0 + 3 * 2 + 7.0)


def test_a_placement_repeated_or_left_out_counts_once() -> None:
    again = ev.SetAside(key="b", from_n=8, reason="snr", retry=True)
    out = ev.SetAside(key="b", from_n=8, reason="no room", left_out=True)
    skip = ev.Answered(key="b", question="?", answer=Answer(action="skip", reason="no room"))
    forecast = TimeLeft(STEPS, StepDurations())
    told = []
    retried: list[tuple[float, ev.Event]] = [(65.0, again), (65.0, placed("b")), *shot(66, "b1")]
    for record in records(*SESSION, *retried, (70, out), (70, skip)):
        forecast.take(record)
        told.append(forecast.done)
    assert (forecast.done, forecast.total) == (2, 3)
    assert max(told) == 2
    # A placing and two shots, which took 1, 3 and 1 s, and the fit.
    assert forecast.seconds_left == pytest.approx(30.0 + 2 * 5 / 3 + 7.0)
