"""A trial in the recording: errors as they come, charts, tables."""

from __future__ import annotations

from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from tests.support.viewer_stream import COLORS, HERE, a_range, a_reading, logged, packed
from tests.viewer.readback import Contents, layout_views
from tests.viewer.session import a_rig
from workbench.model.chart import PALETTE, Axis, Chart, Series
from workbench.model.event import ReadingTaken, TrialFinished
from workbench.model.table import Column, Table
from workbench.viewer.entities import from_hex
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
    view = TrialView(stream, a_rig(), COLORS)
    for n, reading in enumerate(readings, start=1):
        stream.at(Moment(n, 1, HERE.time_ns + n))
        view.take(reading)
    return view


def test_errors_are_measured_minus_true_with_their_variances(tmp_path: Path) -> None:
    reading = a_reading(500.0, 501.5, a_range("L1", 498.0, 3.0), a_range("L4", 502.0, 4.0))
    contents = logged(tmp_path, lambda stream: TrialView(stream, a_rig(), COLORS).take(reading))
    for who, error, variance in (("sensor", 1.5, 4.0), ("L1", -2.0, 9.0), ("L4", 2.0, 16.0)):
        assert contents.values(f"/trial/errors/{who}", "Measurements:values") == [(1, [error])]
        assert contents.values(f"/trial/errors/{who}", "Measurements:variances") == [(1, [variance])]


def test_a_reading_without_a_range_logs_its_lasers_alone(tmp_path: Path) -> None:
    reading = a_reading(500.0, None, a_range("L1", 498.0))
    contents = logged(tmp_path, lambda stream: TrialView(stream, a_rig(), COLORS).take(reading))
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


def test_before_a_trial_its_views_say_so_and_a_stop_shows_nothing_new(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = TrialView(stream, a_rig(), COLORS)
        view.log_none_yet()
        view.stop()

    contents = logged(tmp_path, log)
    assert contents.values("/trial/chart/note", LABELS) == [(1, [NO_TRIAL])]
    assert contents.values("/trial/summary", TEXT) == [(1, [NO_TRIAL])]


def finished(*charts: str) -> TrialFinished:
    return TrialFinished(trial="t", charts=tuple(map(a_chart, charts)))


@pytest.mark.parametrize("names", [("one",), ("one", "two"), ("a.1", "b-2", "c_3")])
def test_every_chart_of_a_finished_trial_is_at_the_origin_of_a_view(
    tmp_path: Path, names: tuple[str, ...]
) -> None:
    contents = logged(tmp_path, lambda stream: TrialView(stream, a_rig(), COLORS).finish(finished(*names)))
    views = layout_views(tmp_path / "part.rrd")
    at = {text: entity for entity in contents.entities for text in titles(contents, entity)}
    assert {f"Title of {name}" for name in names} <= set(at)
    for name in names:
        assert at[f"Title of {name}"].removesuffix("/ticks") in views.values()
    if len(names) > 1:
        for name in names:
            assert f"{views[f'Title of {name}']}/ticks" == at[f"Title of {name}"]


def test_a_second_trial_replaces_the_charts_and_the_layout_of_the_first(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = TrialView(stream, a_rig(), COLORS)
        view.finish(finished("one", "two", "three"))
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        view.finish(finished("four"))

    contents = logged(tmp_path, log)
    views = layout_views(tmp_path / "part.rrd")
    assert "Title of two" not in views
    assert views["Results"] == "/trial/chart"
    assert contents.values("/trial/charts", "Clear:is_recursive")[-1] == (2, [True])


def test_the_same_charts_again_leave_the_layout_as_it_is(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = TrialView(stream, a_rig(), COLORS)
        for _ in range(3):
            view.finish(finished("one", "two"))

    logged(tmp_path, log)
    assert len(RrdReader(str(tmp_path / "part.rrd")).blueprints()) == 2, (
        "the first one, and that of the trial"
    )


def test_the_end_of_the_session_leaves_the_charts_of_a_finished_trial(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = take_all(stream, [a_reading(300.0, 301.0)])
        view.finish(finished("one"))
        stream.at(Moment(9, 9, HERE.time_ns + 9))
        view.stop()

    assert "Title of one" in logged(tmp_path, log).values("/trial/chart/ticks", LABELS)[-1][1]


def test_a_series_of_another_name_has_a_colour_that_no_series_has(tmp_path: Path) -> None:
    one = a_chart("one")
    other = one.series[0].model_copy(update={"name": "mean"})
    trial = TrialFinished(trial="t", charts=(one.model_copy(update={"series": (other, *one.series)}),))
    contents = logged(tmp_path, lambda stream: TrialView(stream, a_rig(), COLORS).finish(trial))
    drawn = [contents.values(f"/trial/chart/series/{name}", "Points2D:colors") for name in ("mean", "L1")]
    colors = [values[-1][1] for values in drawn]
    assert colors == [[packed(from_hex(PALETTE[1]))], [packed(COLORS["L1"])]]


def titles(contents: Contents, entity: str) -> list[str]:
    """Titles of the chart whose ticks are at an entity."""
    if not entity.endswith("/ticks"):
        return []
    return [text for _, texts in contents.values(entity, LABELS) for text in texts if "Title of" in text]
