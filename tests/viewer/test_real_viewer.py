"""The recording in the real viewer: what it shows, not what was logged."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.viewer.conftest import Recorded
from tests.viewer.harness import Picture, Viewer, distinct_colors, headless_viewer
from tests.viewer.ocr import missing_words, need_tesseract
from tests.viewer.readback import Contents
from tests.viewer.session import LASERS, REPEATS, SENSOR_CHART, SESSION, STANDOFFS, TRIAL, a_fit
from workbench.figures.figure import TICK_DISTANCE
from workbench.model import event as ev
from workbench.model.chart import Chart
from workbench.model.chart_scale import tick_texts, x_scale, x_ticks, y_scale
from workbench.model.fit_charts import residual_chart
from workbench.viewer.blueprint import CROPS_VIEW, FRAME_VIEW
from workbench.viewer.entities import laser_colors
from workbench.viewer.table_text import table_text
from workbench.viewer.window import viewer_environment, viewer_executable

TABS = ["Captures", "Calibration: which standoff?", "Calibration: details", TRIAL, "3D"]
HIDDEN = {
    "Parameters": TABS[0],
    "Largest [%]": TABS[0],
    "Fitted parameters": TABS[2],
    SENSOR_CHART: TRIAL,
}
"""Views behind another one in a tab, with their screens."""
RESIDUALS = "Residuals along u"
TABLES = "Tables: scroll, or enlarge"
SHARES, NARROW = [6.0, 7.0, 13.0], {"col_shares": [6.0, 7.0, 6.0]}
"""Widths of frame, spots and tables of a trial, and such that cut the tables."""
CUT = {"range": {"x_range": [250, 1350], "y_range": [0, 370]}}
"""Bounds of a chart that cut the first standoff, the labels beside the axis, and the legend below it."""
SERIES = "Error [mm], u shaded; right click: go to the reading"


@pytest.fixture(scope="module", params=["1280x720"])
def viewer(
    request: pytest.FixtureRequest, recorded: Recorded, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Viewer]:
    with headless_viewer(tmp_path_factory.mktemp("viewer"), request.param) as running:
        running.open(recorded.recording)
        yield running


def test_the_file_is_complete_and_readable(recorded: Recorded, tmp_path: Path) -> None:
    command = [str(viewer_executable()), "rrd", "verify", str(recorded.recording)]
    environment = {**viewer_environment(), "HOME": str(tmp_path)}
    assert subprocess.run(command, env=environment, capture_output=True, timeout=60).returncode == 0


def test_shows_recording_timelines_and_screens(viewer: Viewer) -> None:
    state = viewer.state()
    assert SESSION in state.active_recording
    (recording,) = state.recordings
    spans = {line.name: (line.start, line.end) for line in recording.timelines}
    assert set(spans) == {"capture", "step", "time", "standoff_mm"}
    assert (spans["capture"], spans["step"]) == ((1, 41), (1, 9))
    assert spans["standoff_mm"] == (min(STANDOFFS), max(STANDOFFS))
    assert (recording.current_timeline, recording.current_time) == ("capture", 41)
    assert viewer.tabs() == TABS


def test_every_view_shows_something_and_none_complains(viewer: Viewer) -> None:
    """At the first placement, where a layout that loses the fit would be empty."""
    viewer.go_to("capture", 1)
    seen: set[str] = set()
    for tab in TABS:
        viewer.show_tab(tab)
        viewer.shot()
        front = {view.name: view.view_id for view in viewer.views_in_front()}
        for name in front.keys() - seen:
            assert distinct_colors(viewer.glance(front[name])) > 30, (tab, name)
        seen |= front.keys()
        assert viewer.problems() == []
    assert {view.name for view in viewer.state().views} - seen == HIDDEN.keys()
    for name, tab in HIDDEN.items():
        viewer.show_tab(tab)
        viewer.show_tab(name)
        viewer.shot()
        assert distinct_colors(viewer.glance(viewer.view_id(name))) > 30, name


def test_titles_tables_ticks_and_legends_are_whole(recorded: Recorded, viewer: Viewer) -> None:
    need_tesseract()
    viewer.show_tab(TABS[1])
    viewer.shot()
    assert missing_words(_view(viewer, RESIDUALS), _texts(residual_chart(a_fit(), "u"))) == set()
    errors, table = _results(recorded)
    _show_trial(viewer, errors)
    titles = [*TABS, FRAME_VIEW, CROPS_VIEW, TABLES, SENSOR_CHART, SERIES, str(errors.title)]
    assert missing_words(viewer.shot(), titles) == set()
    assert missing_words(_view(viewer, str(errors.title)), _texts(errors)) == set()
    assert missing_words(_view(viewer, TABLES), table) == set()


def test_a_label_that_is_cut_is_found(recorded: Recorded, viewer: Viewer) -> None:
    """The test above can fail: a legend below the view, ticks beside it, a table wider than its view."""
    need_tesseract()
    errors, table = _results(recorded)
    _show_trial(viewer, errors)
    before = viewer.layout()
    try:
        viewer.change("VisualBounds2D", lambda _: CUT)
        viewer.change("ContainerBlueprint", lambda one: NARROW if one.get("col_shares") == SHARES else {})
        viewer.shot()
        missing = missing_words(_view(viewer, str(errors.title)), _texts(errors))
        assert {"300", "0.5", "sensor"} <= missing
        assert missing.isdisjoint({"800", "2000", "standoff"})
        assert "reference" in missing_words(_view(viewer, TABLES), table)
    finally:
        viewer.lay_out(before)


def _show_trial(viewer: Viewer, chart: Chart) -> None:
    viewer.show_tab(TRIAL)
    viewer.show_tab(str(chart.title))


def _results(recorded: Recorded) -> tuple[Chart, list[str]]:
    """Chart in front of the trial, and the words of its table; digits of its font are often misread."""
    (finished,) = (r.event for r in recorded.records if isinstance(r.event, ev.TrialFinished))
    text = table_text(finished.tables[0])
    return finished.charts[0], [word for word in text.split() if word.strip(".,:;()").isalpha()]


def _texts(chart: Chart) -> list[str]:
    """Everything that is written level in the picture of a chart."""
    x, y = x_scale(chart), y_scale(chart)
    above, below = x_ticks(chart, x, TICK_DISTANCE)
    ticks = [*tick_texts([*above, *below]), *tick_texts(y.round_ticks())]
    return [chart.title, chart.x.text, *ticks, *(series.name for series in chart.series)]


def _view(viewer: Viewer, name: str) -> Picture:
    """The view in front with a title."""
    (view,) = (view for view in viewer.views_in_front() if view.name == name)
    return viewer.glance(view.view_id)


@pytest.mark.parametrize("viewer", ["1600x900"], indirect=True)
def test_the_frame_is_that_of_the_capture_with_its_contrast_stretched(
    recorded: Recorded, viewer: Viewer
) -> None:
    taken = [r.event for r in recorded.records if isinstance(r.event, ev.CaptureTaken)]
    ranges = dict(Contents(recorded.recording).values("/frame/image", "EncodedDepthImage:depth_range"))
    viewer.show_tab(TABS[0])
    for capture in (1, 35):
        viewer.go_to("capture", capture)
        shown = _frame(viewer)
        ((low, high),) = ranges[capture]
        assert low == 0.0
        assert high < 0.8, "the frame is dark"
        stored = cv2.imread(str(recorded.folder / taken[capture - 1].on.path), cv2.IMREAD_GRAYSCALE)
        assert stored is not None
        expected = np.clip(stored / (255.0 * high), 0.0, 1.0) * 255.0
        assert float(np.median(np.abs(shown[:, :, 0] - expected))) < 4.0
    assert _drawn_lasers(shown) == set(LASERS)


@pytest.mark.parametrize("viewer", ["1600x900"], indirect=True)
def test_the_standoff_timeline_shows_the_last_frame_at_the_standoff(viewer: Viewer) -> None:
    """A right click in the series beside a chart moves this cursor. Two frames differ by their noise."""
    viewer.show_tab(TABS[1])
    viewer.go_to("capture", 2 * len(LASERS) * REPEATS)
    by_capture = _frame(viewer).astype(int)
    viewer.go_to("standoff_mm", round(STANDOFFS[1]))
    assert np.abs(_frame(viewer) - by_capture).mean() < 0.2
    viewer.go_to("standoff_mm", round(STANDOFFS[2]))
    assert np.abs(_frame(viewer) - by_capture).mean() > 1.0


def _frame(viewer: Viewer) -> Picture:
    """(480, 640, 3) picture in the frame view of the screen in front; marks included."""
    viewer.shot()
    (view,) = (view for view in viewer.views_in_front() if view.name == FRAME_VIEW)
    shown = viewer.glance(view.view_id)
    scale = min(shown.shape[1] / 640, shown.shape[0] / 480)
    width, height = round(640 * scale), round(480 * scale)
    left, top = (shown.shape[1] - width) // 2, (shown.shape[0] - height) // 2
    inside = shown[top : top + height, left : left + width]
    return np.asarray(cv2.resize(inside, (640, 480), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _drawn_lasers(shown: Picture) -> set[str]:
    """Lasers whose colour is drawn into the picture."""
    colors = laser_colors(list(LASERS))
    near = {
        laser: np.abs(shown.astype(int) - np.array(rgb[::-1])).max(axis=2) < 60
        for laser, rgb in colors.items()
    }
    return {laser for laser, pixels in near.items() if pixels.sum() > 10}
