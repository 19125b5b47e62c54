"""A trial in the recording: errors as they come, its own tab, charts and tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.viewer_stream import COLORS, START_NS, a_range, a_reading, logged
from tests.viewer.readback import Contents
from workbench.figures.picture import note, picture
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import ReadingTaken, TrialFinished, TrueValues
from workbench.model.reading_chart import error_chart
from workbench.model.table import Column, Table
from workbench.viewer.blueprint import TrialTab
from workbench.viewer.chart import CURSOR_HALF_PX
from workbench.viewer.entities import to_hex
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text
from workbench.viewer.trial import LIVE_CHART, NO_READING, TrialView, error_ends_mm, tabs

TEXT, BLOB, STRIPS = "TextDocument:text", "EncodedImage:blob", "LineStrips2D:strips"
VALUES = "Measurements:values"
TABLE = Table(name="t", title="A table", columns=(Column(key="a", name="a"),), rows=((1,),))
HEX = {**{laser: to_hex(color) for laser, color in COLORS.items()}, "sensor": "#ebebeb"}
SIX = [a_reading(s, s + 1.0) for s in (300.0, 300.0, 300.0, 800.0, 800.0, 2000.0)]


def a_chart(name: str, title: str | None = None) -> Chart:
    return Chart(
        name=name,
        title=f"Title of {name}" if title is None else title,
        x=Axis(label="standoff", unit="mm"),
        y=Axis(label="error", unit="mm"),
        series=(Series(name="L1", x=(300.0, 2000.0), y=(0.5, -0.5)),),
    )


def finished(*charts: str, trial: str = "t") -> TrialFinished:
    return TrialFinished(trial=trial, tables=(TABLE,), charts=tuple(map(a_chart, charts)))


def started(stream: Stream, trial: str = "t") -> TrialView:
    view = TrialView(stream, COLORS, trial)
    view.start()
    return view


def take_all(stream: Stream, readings: list[ReadingTaken], first: int = 1, trial: str = "t") -> TrialView:
    """One capture for each reading."""
    view = started(stream, trial)
    for n, reading in enumerate(readings, start=first):
        view.take(reading, Moment(n, 1, START_NS + n, reading.standoff_mm))
    return view


def pictures(contents: Contents, chart: str = LIVE_CHART, trial: str = "t") -> list[bytes]:
    return list(contents.static(f"/trials/{trial}/pictures/{chart}/image", BLOB))


def texts(contents: Contents, trial: str = "t") -> list[str]:
    return [text for (text,) in contents.static(f"/trials/{trial}/tables", TEXT)]


def test_errors_are_measured_minus_true_with_their_variances(tmp_path: Path) -> None:
    reading = a_reading(500.0, 501.5, a_range("L1", 498.0, 3.0), a_range("L4", 502.0, 4.0))
    contents = logged(tmp_path, lambda stream: take_all(stream, [reading]))
    for name, error, variance in (("sensor", 1.5, 4.0), ("L1", -2.0, 9.0), ("L4", 2.0, 16.0)):
        assert contents.values(f"/trials/t/errors/{name}", VALUES) == [(1, [error])]
        assert contents.values(f"/trials/t/errors/{name}", "Measurements:variances") == [(1, [variance])]


def test_a_reading_without_a_range_logs_its_lasers_alone(tmp_path: Path) -> None:
    reading = a_reading(500.0, None, a_range("L1", 498.0))
    contents = logged(tmp_path, lambda stream: take_all(stream, [reading]))
    assert "/trials/t/errors/sensor" not in contents.entities
    assert contents.values("/trials/t/errors/L1", VALUES) == [(1, [-2.0])]


def test_lasers_have_no_errors_where_the_true_range_is_not_the_standoff(tmp_path: Path) -> None:
    reading = a_reading(500.0, 481.0, a_range("L1", 498.0)).model_copy(
        update={"true": TrueValues(range_mm=480.0, range_sd_mm=0.5)}
    )
    contents = logged(tmp_path, lambda stream: take_all(stream, [reading]))
    assert contents.values("/trials/t/errors/sensor", VALUES) == [(1, [1.0])]
    assert "/trials/t/errors/L1" not in contents.entities


def test_the_views_of_a_trial_have_notes_before_the_first_reading(tmp_path: Path) -> None:
    contents = logged(tmp_path, started)
    assert pictures(contents) == [note(NO_READING)]
    assert texts(contents) == [NO_READING]


def test_the_chart_follows_once_a_standoff(tmp_path: Path) -> None:
    """At the first reading of a new standoff it shows all before."""
    drawn = pictures(logged(tmp_path, lambda stream: take_all(stream, SIX)))
    expected = [picture(error_chart(LIVE_CHART, SIX[:n]), HEX).png for n in (3, 5)]
    assert drawn == [note(NO_READING), *expected]


def test_the_stop_of_a_session_draws_the_readings_that_are_not_drawn_yet(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: take_all(stream, SIX).stop())
    assert pictures(contents)[-1] == picture(error_chart(LIVE_CHART, SIX), HEX).png
    assert texts(contents)[-1].splitlines()[0].startswith("6 ")


def test_a_stop_before_the_first_reading_changes_nothing(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: started(stream).stop())
    assert pictures(contents) == [note(NO_READING)]
    assert texts(contents) == [NO_READING]


def test_a_stop_after_the_results_leaves_them(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        for charts in ((), ("one",)):
            view = take_all(stream, SIX, trial=f"with {len(charts)}")
            view.finish(finished(*charts))
            view.stop()

    contents = logged(tmp_path, log)
    for trial in ("with\\ 0", "with\\ 1"):
        assert texts(contents, trial)[-1] == table_text(TABLE)


def test_readings_outside_their_interval_are_remarked_while_the_trial_runs(tmp_path: Path) -> None:
    bad = a_reading(300.0, None, reading=3)
    contents = logged(tmp_path, lambda stream: take_all(stream, [SIX[0], bad, SIX[3]]))
    _, remark = texts(contents)[-1].splitlines()
    assert "300 mm, reading 3" in remark


def test_results_have_all_charts_tables_and_readings_without_a_range(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        readings = [a_reading(300.0, 301.0), a_reading(2000.0, None)]
        take_all(stream, readings).finish(finished("one", "two.2"))

    contents = logged(tmp_path, log)
    for name in ("one", "two.2"):
        assert pictures(contents, name) == [picture(a_chart(name), HEX).png]
    assert texts(contents)[-1].startswith(table_text(TABLE))
    assert "2000 mm" in texts(contents)[-1]
    assert "300 mm" not in texts(contents)[-1]


def test_results_without_charts_show_the_errors_of_all_readings(tmp_path: Path) -> None:
    kept: list[TrialView] = []

    def log(stream: Stream) -> None:
        kept.append(take_all(stream, SIX))
        kept[0].finish(finished())

    contents = logged(tmp_path, log)
    assert pictures(contents)[-1] == picture(error_chart(LIVE_CHART, SIX), HEX).png
    assert [name for name, _ in kept[0].tab.charts] == [LIVE_CHART]


def cursor(contents: Contents, chart: str, capture: int) -> float | None:
    """Middle of the frame around the present standoff's points."""
    strips = contents.shown(f"/trials/t/pictures/{chart}/cursor", STRIPS, "capture", capture)
    if not strips:
        return None
    us = [point[0] for point in strips[0]]
    assert max(us) - min(us) == pytest.approx(2 * CURSOR_HALF_PX)
    return float(min(us) + max(us)) / 2


def test_a_frame_in_every_chart_is_at_the_standoff_of_the_reading(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        take_all(stream, SIX, first=11).finish(finished("one"))

    contents = logged(tmp_path, log)
    live = picture(error_chart(LIVE_CHART, SIX[:5]), HEX).x_px
    ends = picture(a_chart("one"), HEX).x_px
    assert cursor(contents, LIVE_CHART, 10) is cursor(contents, "one", 10) is None
    for capture in (11, 13):
        assert cursor(contents, LIVE_CHART, capture) == pytest.approx(live[300.0])
        assert cursor(contents, "one", capture) == pytest.approx(ends[300.0])
    assert cursor(contents, LIVE_CHART, 14) == pytest.approx(live[800.0])
    assert cursor(contents, "one", 14) is None, "it has no points at 800 mm"
    assert cursor(contents, "one", 16) == pytest.approx(ends[2000.0])


def test_two_trials_keep_their_own_entities_and_tabs(tmp_path: Path) -> None:
    kept: list[TrialTab] = []

    def log(stream: Stream) -> None:
        first = take_all(stream, SIX[:2], trial="first")
        first.finish(finished("one", trial="first"))
        second = take_all(stream, SIX[3:], first=3, trial="second run")
        kept.extend(tabs([first, second]))

    contents = logged(tmp_path, log)
    assert [at for at, _ in contents.values("/trials/first/errors/sensor", VALUES)] == [1, 2]
    assert [at for at, _ in contents.values("/trials/second\\ run/errors/sensor", VALUES)] == [3, 4, 5]
    assert texts(contents, "first")[-1] == table_text(TABLE)
    assert pictures(contents, "one", "first") == [picture(a_chart("one"), HEX).png]
    assert len(pictures(contents, trial="second\\ run")) == 2, "a note, and the readings at 800 mm"
    first, second = kept
    assert (first.trial, second.trial) == ("first", "second run")
    assert first.charts == (("one", "Title of one"),)
    assert [name for name, _ in second.charts] == [LIVE_CHART]


def test_a_chart_without_a_title_has_its_name_in_the_tab(tmp_path: Path) -> None:
    kept: list[TrialView] = []

    def log(stream: Stream) -> None:
        kept.append(started(stream))
        kept[0].finish(TrialFinished(trial="t", charts=(a_chart("one", ""),)))

    logged(tmp_path, log)
    assert kept[0].tab.charts == (("one", "one"),)


def test_the_axis_of_errors_has_room_for_their_uncertainty_once_the_trial_has_finished(
    tmp_path: Path,
) -> None:
    kept: list[TrialView] = []
    logged(tmp_path, lambda stream: kept.append(take_all(stream, SIX)))
    assert kept[0].tab.errors_mm is None
    kept[0].charts = (a_chart("one"),)
    ends = kept[0].tab.errors_mm
    assert ends is not None
    sds = [(one.error_mm, one.sigma_mm) for one in SIX]
    sds += [(laser.range_mm - one.standoff_mm, laser.sigma_mm) for one in SIX for laser in one.lasers]
    assert all(e is not None and sd is not None and ends[0] < e - sd and e + sd < ends[1] for e, sd in sds)
    assert error_ends_mm([]) is None
