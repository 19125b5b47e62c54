"""The recording in the real viewer: what it shows, not what it was told."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.viewer.conftest import Recorded
from tests.viewer.harness import Picture, Viewer, distinct_colors, headless_viewer
from tests.viewer.session import LASERS, SESSION
from workbench.model import event as ev
from workbench.model.chart import Axis, Chart, Series
from workbench.viewer.blueprint import PICTURE_VIEW
from workbench.viewer.entities import laser_colors
from workbench.viewer.recording import rebuild

VIEWS_OF_TAB = {
    "Live": {PICTURE_VIEW, "Standoff [mm]", "Spot position u [px]", "Peak brightness [DN]", "Steps", "Log"},
    "Fit": {
        "Residuals u",
        "Residuals v",
        "Verdict",
        "Checks",
        "Parameters",
    },
    "Trial": {
        "Results",
        "Error of the sensor [mm] during the trial",
        "Tables",
    },
    "3D": {"Bench: rays, target, spots"},
}


@pytest.fixture(scope="module")
def viewer(recorded: Recorded, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewer]:
    with headless_viewer(tmp_path_factory.mktemp("viewer"), "1280x720") as running:
        running.open(recorded.recording)
        yield running


def test_shows_recording_timelines_and_views(viewer: Viewer) -> None:
    state = viewer.state()
    assert SESSION in state.active_recording
    (recording,) = state.recordings
    spans = {line.name: (line.start, line.end) for line in recording.timelines}
    assert set(spans) == {"capture", "step", "time", "standoff_mm"}
    assert (spans["capture"], spans["step"]) == ((0, 41), (0, 9))
    assert (recording.current_timeline, recording.current_time) == ("capture", 41)
    assert {view.name for view in state.views} == set.union(*VIEWS_OF_TAB.values())


def test_every_view_shows_something_and_none_complains(viewer: Viewer) -> None:
    for tab, names in VIEWS_OF_TAB.items():
        viewer.show_tab(tab)
        viewer.shot()
        for name in names:
            assert distinct_colors(viewer.glance(viewer.view_id(name))) > 30, name
        assert viewer.problems() == []


def test_picture_is_the_frame_of_the_capture(recorded: Recorded, viewer: Viewer) -> None:
    taken = [r.event for r in recorded.records if isinstance(r.event, ev.CaptureTaken)]
    found = [r.event for r in recorded.records if isinstance(r.event, ev.SpotsFound)]
    viewer.show_tab("Live")
    for capture in (1, 4, 35):
        viewer.go_to("capture", capture)
        shown = viewer.shot(viewer.view_id(PICTURE_VIEW))
        assert _difference_dn(recorded.folder / taken[capture - 1].on.path, shown) < 3.0
        assert _ringed(shown) == {spot.laser_id for spot in found[capture - 1].spots}


def _difference_dn(frame: Path, shown: Picture) -> float:
    """Median difference of a frame and of what the view shows between its black margins."""
    stored = cv2.imread(str(frame), cv2.IMREAD_GRAYSCALE)
    assert stored is not None
    lit = np.flatnonzero((shown.max(axis=2) > 5).mean(axis=0) > 0.8)
    assert len(lit) > shown.shape[1] / 2, "the view shows no frame"
    inside = cv2.cvtColor(shown[:, lit[0] : lit[-1] + 1], cv2.COLOR_BGR2GRAY)
    same_size = cv2.resize(inside, (stored.shape[1], stored.shape[0]), interpolation=cv2.INTER_AREA)
    return float(np.median(np.abs(same_size.astype(float) - stored.astype(float))))


def _ringed(shown: Picture) -> set[str]:
    """Lasers whose colour is drawn into the picture."""
    colors = laser_colors(list(LASERS))
    return {laser for laser, rgb in colors.items() if (shown == np.array(rgb[::-1])).all(axis=2).sum() > 10}


def test_every_chart_of_a_trial_has_a_tab_that_shows_it(recorded: Recorded, tmp_path: Path) -> None:
    *earlier, last = recorded.records
    charts = tuple(a_chart(name) for name in ("first", "second", "third"))
    finished = last.model_copy(update={"event": ev.TrialFinished(trial="own", charts=charts)})
    rebuild(recorded.folder, recorded.rig, [*earlier, finished, last], tmp_path / "charts.rrd")
    titles = {chart.title for chart in charts}
    # A viewer of its own: the other one keeps the layout that was changed in it.
    with headless_viewer(tmp_path, "1280x720") as viewer:
        viewer.open(tmp_path / "charts.rrd")
        names = {view.name for view in viewer.state().views}
        assert names == set.union(*VIEWS_OF_TAB.values()) - {"Results"} | titles
        viewer.show_tab("Trial")
        for title in titles:
            viewer.show_tab(title)
            viewer.shot()
            assert distinct_colors(viewer.glance(viewer.view_id(title))) > 30, title
        assert viewer.problems() == []


def a_chart(name: str) -> Chart:
    series = Series(name="L1", x=(1.0, 2.0, 3.0), y=(0.5, -0.5, 0.2))
    x, y = Axis(label="standoff", unit="mm"), Axis(label="error", unit="mm")
    return Chart(name=name, title=f"Chart {name}", x=x, y=y, series=(series,))
