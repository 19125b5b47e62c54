"""What a running session shows on the terminal."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping

import pytest
from rich.console import Console

from tests.support.records import SESSION, STEPS, records
from workbench.cli.terminal import FaultTolerantConsumer, Terminal, _summary, about
from workbench.model import event as ev
from workbench.model.errors import StoppedError
from workbench.model.number_text import counted
from workbench.model.prompt import Answer
from workbench.model.spot import Spot
from workbench.model.table import Column, Table
from workbench.procedure.engine.durations import StepDurations
from workbench.procedure.engine.progress import TimeLeft

STARTED = ev.ProcedureStarted(procedure="p", title="Our procedure", steps=2)


def console() -> tuple[Console, io.StringIO]:
    stream = io.StringIO()
    return Console(file=stream, width=80, markup=False), stream


def shown(*timed: tuple[float, ev.Event], kept: Mapping[str, int] | None = None) -> list[str]:
    there, stream = console()
    with Terminal(there, TimeLeft(STEPS, StepDurations()), kept=kept or {}) as terminal:
        for record in records((0, STARTED), *timed):
            terminal(record)
    return stream.getvalue().splitlines()


def spots(key: str, *centres_px: tuple[float, float]) -> ev.SpotsFound:
    found = [
        Spot(
            laser_id=None, u_px=u, v_px=v, u_sd_px=0.05, v_sd_px=0.05, flux_dn=1.0, width_px=2.0, peak_dn=9.0
        )
        for u, v in centres_px
    ]
    return ev.SpotsFound(key=key, spots=tuple(found))


def test_a_placement_is_summed_up_when_it_is_finished() -> None:
    """Lasers seen, least signal to noise (2 / 0.05), largest scatter (1 / sqrt(2))."""
    session = [one for one in SESSION if not isinstance(one[1], ev.SpotsFound | ev.PlacementFinished)]
    seen = [(22.0, spots("a1", (10.0, 5.0))), (22.0, spots("a2", (11.0, 5.0)))]
    lines = shown(*session[:4], *seen, (23.0, ev.PlacementFinished(key="a")))
    (line,) = [line for line in lines if "1/1 lasers" in line]
    assert {"500", "40", "0.707"} <= set(line.replace(",", " ").split())
    (progress,) = [line for line in lines if line.strip().startswith("placement ")]
    assert [int(word) for word in progress.split()[1:4:2]] == [1, 3]


def test_a_turned_head_has_no_common_scatter() -> None:
    """Each angle is another beam: its spots are counted."""
    session: list[tuple[float, ev.Event]] = []
    for at, event in SESSION:
        if isinstance(event, ev.CaptureTaken):
            session.append((at, event.model_copy(update={"head_deg": 5.0})))
        elif not isinstance(event, ev.SpotsFound | ev.PlacementFinished):
            session.append((at, event))
    seen = [(22.0, spots("a1", (10.0, 5.0))), (22.0, spots("a2"))]
    lines = shown(*session[:4], *seen, (23.0, ev.PlacementFinished(key="a")))
    (line,) = [line for line in lines if "of the head" in line]
    assert "2 captures of the head, 1 with a spot" in line
    assert "scatter" not in line


def test_a_placement_that_is_kept_shows_no_progress_until_it_is_captured_again() -> None:
    end = ev.PlacementFinished(key="a")
    again = [(24.0, ev.SetAside(key="a", from_n=0, reason="moved")), *SESSION[1:4]]
    once = [line for line in shown(*SESSION[:4], (23.0, end), kept={"a": 2}) if "lasers" in line]
    twice = shown(*SESSION[:4], (23.0, end), *again, (25.0, end), kept={"a": 2})
    assert next(line for line in twice if "lasers" in line) == once[0]
    assert len([line for line in twice if line.strip().startswith("placement ")]) == 1
    assert not [line for line in shown(*SESSION[:4], (23.0, end), kept={"a": 2}) if "placement 1" in line]
    assert "(kept)" in once[0]


def test_a_replayed_placement_shows_the_captures_read_so_far() -> None:
    lines = shown(*SESSION[:4], (23.0, ev.PlacementFinished(key="a")), kept={"a": 1, "b": 3})
    (progress,) = [line for line in lines if line.strip().startswith("replayed ")]
    assert [int(number) for number in re.findall(r"\d+", progress)[:2]] == [1, 4]


def test_an_overruled_check_is_repeated_with_the_advice_until_its_placement_is_set_aside() -> None:
    advice = ev.StandoffAdvised(
        placements=4, relative_range_sd=0.1, limit=0.05, next_standoff_mm=900.0, then_relative_range_sd=0.05
    )
    asked = ev.Answered(key="a/standoff", question="C1. Keep it?", answer=Answer(), overrules=True)
    other = asked.model_copy(update={"question": "C2. Keep it?", "overrules": False})
    lines = shown((1, asked), (2, other), (3, advice), (4, ev.SetAside(key="a", from_n=0, reason="x")))
    assert len([line for line in lines if "C1" in line]) == 1
    assert not [line for line in lines if "C2" in line or "Keep it?" in line]
    later = shown((1, asked), (2, ev.SetAside(key="a", from_n=0, reason="x")), (3, advice))
    assert not [line for line in later if "C1" in line]


@pytest.mark.parametrize(("readings", "spots"), [(1, 1), (1, 2), (3, 1), (2, 4)])
def test_readings_and_spots_are_singular_or_plural(readings: int, spots: int) -> None:
    one = Spot(1.0, 2.0, 0.1, 0.1, 1e3, 1.5, 90.0)
    text = _summary({"all": [[one] * spots] * readings})
    assert re.findall(r"\d+ \w+", text) == [counted(readings, "reading"), counted(spots, "spot")]


def test_lasers_without_a_spot_are_named() -> None:
    one = Spot(1.0, 2.0, 0.1, 0.1, 1e3, 1.5, 90.0)
    text = _summary({"L1": [[one]], "L2": [[]], "L3": [[one, one]]})
    assert "1/3 lasers" in text
    assert "L2, L3" in text
    assert "L1" not in text
    assert "NOT SEEN" not in _summary({"L1": [[one]]})


def test_what_is_wrong_is_shown_and_what_is_well_is_not() -> None:
    checked = ev.LimitChecked(
        step="p.1", of="a/L1", quantity="snr", value=7.0, limit="at least 9", verdict="fail"
    )
    passed = checked.model_copy(update={"quantity": "missing", "verdict": "pass"})
    text = "\n".join(shown((1, checked), (2, passed)))
    assert "a/L1: snr 7" in text
    assert "missing" not in text


def test_tables_of_a_trial_are_shown_within_the_width() -> None:
    table = Table(
        name="t",
        title="Numbers",
        columns=(Column(key="x_mm", name="x", unit="mm", format=".1f"),),
        rows=((1.25,),),
    )
    lines = shown((1, ev.TrialFinished(trial="p.1", tables=(table,))))
    assert any("1.2" in line for line in lines)
    assert max(map(len, lines)) <= 80


def test_a_consumer_that_fails_is_told_once_and_asked_never_again() -> None:
    calls: list[int] = []

    def fails(record: ev.Record) -> None:
        calls.append(record.n)
        raise OSError("disk full")

    there, stream = console()
    consumer = FaultTolerantConsumer(fails, "drawing", there)
    first, second = records((0, STARTED), (1, STARTED))
    with pytest.raises(ev.ConsumerFailedError) as failed:
        consumer(first)
    assert failed.value.incident == ev.Incident(of="drawing", message="disk full")
    consumer(second)
    assert calls == [0]
    assert stream.getvalue().count("disk full") == 1


def test_a_stop_goes_through_a_fault_tolerant_consumer() -> None:
    def stops(record: ev.Record) -> None:
        raise StoppedError("enough")

    with pytest.raises(StoppedError):
        FaultTolerantConsumer(stops, "drawing", console()[0])(records((0, STARTED))[0])


@pytest.mark.parametrize(
    ("seconds", "number", "unit"),
    [(14.0, "10", "s"), (94.0, "90", "s"), (95.0, "2", "min"), (5399.0, "90", "min"), (5400.0, "1.5", "h")],
)
def test_times_are_no_finer_than_an_estimate_is(seconds: float, number: str, unit: str) -> None:
    assert about(seconds).split()[-2:] == [number, unit]


def test_detail_tables_are_left_to_the_recording() -> None:
    table = Table(name="t", title="Shown", columns=(Column(key="a", name="a"),), rows=((1,),))
    detail = table.model_copy(update={"title": "Hidden", "is_detail": True})
    lines = shown((1.0, ev.TrialFinished(trial="p.1", tables=(table, detail))))
    assert any("Shown" in line for line in lines)
    assert not any("Hidden" in line for line in lines)
