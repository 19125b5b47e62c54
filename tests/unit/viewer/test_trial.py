"""A trial in the recording: errors as they come, charts, tables."""

from __future__ import annotations

from pathlib import Path

from tests.support.viewer_stream import COLORS, HERE, a_range, a_reading, logged
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import ReadingTaken, TrialFinished, TrialProgress
from workbench.model.table import Column, Table
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text
from workbench.viewer.trial import NO_TRIAL, TrialView

TEXT, LABELS = "TextDocument:text", "Points2D:labels"
TABLE = Table(name="t", title="A table", columns=(Column(key="a", name="a"),), rows=((1,),))


def a_chart(name: str, title: str = "") -> Chart:
    return Chart(
        name=name,
        title=title or f"Title of {name}",
        x=Axis(label="standoff", unit="mm"),
        y=Axis(label="error", unit="mm"),
        series=(Series(name="L1", x=(1.0, 2.0), y=(0.5, -0.5)),),
    )


def take_all(stream: Stream, readings: list[ReadingTaken]) -> TrialView:
    """One capture for each reading."""
    view = TrialView(stream, COLORS)
    for n, reading in enumerate(readings, start=1):
        stream.at(Moment(n, 1, HERE.time_ns + n))
        view.take(reading)
    return view


def test_errors_are_measured_minus_true_with_their_variances(tmp_path: Path) -> None:
    reading = a_reading(500.0, 501.5, a_range("L1", 498.0, 3.0), a_range("L4", 502.0, 4.0))
    contents = logged(tmp_path, lambda stream: TrialView(stream, COLORS).take(reading))
    for who, error, variance in (("sensor", 1.5, 4.0), ("L1", -2.0, 9.0), ("L4", 2.0, 16.0)):
        assert contents.values(f"/trial/errors/{who}", "Measurements:values") == [(1, [error])]
        assert contents.values(f"/trial/errors/{who}", "Measurements:variances") == [(1, [variance])]


def test_a_reading_without_a_range_logs_its_lasers_alone(tmp_path: Path) -> None:
    reading = a_reading(500.0, None, a_range("L1", 498.0))
    contents = logged(tmp_path, lambda stream: TrialView(stream, COLORS).take(reading))
    assert "/trial/errors/sensor" not in contents.entities
    assert contents.values("/trial/errors/L1", "Measurements:values") == [(1, [-2.0])]


def test_the_chart_follows_once_a_standoff(tmp_path: Path) -> None:
    readings = [a_reading(s, s + 1.0) for s in (300.0, 300.0, 300.0, 800.0, 800.0, 2000.0)]
    contents = logged(tmp_path, lambda stream: take_all(stream, readings))
    # At the fourth and the sixth reading, each the first of a new standoff.
    assert [number for number, _ in contents.values("/trial/chart/ticks", LABELS)] == [4, 6]
    assert [number for number, _ in contents.values("/trial/summary", TEXT)] == [4, 6]


def test_another_trial_forgets_the_readings_of_the_one_before(tmp_path: Path) -> None:
    kept: list[int] = []

    def log(stream: Stream) -> None:
        view = take_all(stream, [a_reading(300.0, 301.0), a_reading(300.0, 301.0)])
        view.take(a_reading(300.0, 301.0, trial="other"))
        kept.append(len(view.readings))

    logged(tmp_path, log)
    assert kept == [1]


def test_results_show_the_first_chart_in_front_and_the_others_below(tmp_path: Path) -> None:
    finished = TrialFinished(trial="t", tables=(TABLE,), charts=(a_chart("one"), a_chart("two")))

    def log(stream: Stream) -> None:
        take_all(stream, [a_reading(300.0, 301.0), a_reading(900.0, None)]).finish(finished)

    contents = logged(tmp_path, log)
    assert "Title of one" in contents.values("/trial/chart/ticks", LABELS)[-1][1]
    assert "Title of two" in contents.values("/trial/charts/two/ticks", LABELS)[-1][1]
    (text,) = contents.values("/trial/summary", TEXT)[-1][1]
    assert table_text(TABLE) in text
    assert "900 mm" in text
    assert "300 mm" not in text


def test_results_without_charts_show_the_errors_of_all_readings(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        take_all(stream, [a_reading(300.0, 301.0), a_reading(300.0, 302.0)]).finish(TrialFinished(trial="t"))

    contents = logged(tmp_path, log)
    ((_, points),) = contents.values("/trial/chart/series/sensor", "Points2D:positions")
    assert len(points) == 3, "one of the legend, and one of each reading"


def test_progress_shows_its_charts(tmp_path: Path) -> None:
    progress = TrialProgress(trial="t", text="half", charts=(a_chart("one"),))
    contents = logged(tmp_path, lambda stream: TrialView(stream, COLORS).progress(progress))
    assert "Title of one" in contents.values("/trial/chart/ticks", LABELS)[-1][1]


def test_before_a_trial_its_views_say_so_and_a_stop_shows_nothing_new(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = TrialView(stream, COLORS)
        view.log_none_yet()
        view.stop()

    contents = logged(tmp_path, log)
    assert contents.values("/trial/chart/note", LABELS) == [(1, [NO_TRIAL])]
    assert contents.values("/trial/summary", TEXT) == [(1, [NO_TRIAL])]
