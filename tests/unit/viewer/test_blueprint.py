"""The layout: a screen for each phase, every view with a part of the recording, in the rig's own measures."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rerun.blueprint as rrb

from tests.support.rigs import prior
from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents, front_tab, layout_views
from tests.viewer.session import TRIAL, a_rig
from workbench.figures.picture import SIZE_PX
from workbench.model.rig import Rig
from workbench.viewer.blueprint import CROPS_VIEW, FRAME_VIEW, Phase, TrialTab, blueprint
from workbench.viewer.crops import mosaic_size

TRIALS = (
    TrialTab("accuracy", (("errors", "Errors so far"),)),
    TrialTab("round", (("one", "First"), ("two", "Second"))),
)
SCREENS = ["Captures", "Calibration: which standoff?", "Calibration: details"]


def screens(rig: Rig, trials: tuple[TrialTab, ...] = (), phase: Phase = "capture") -> rrb.Tabs:
    root = blueprint(rig, trials, phase).root_container
    assert isinstance(root, rrb.Tabs)
    return root


def views_below(container: rrb.Container) -> Iterator[rrb.View]:
    for part in container.contents:
        if isinstance(part, rrb.Container):
            yield from views_below(part)
        elif isinstance(part, rrb.View):
            yield part


def by_screen(root: rrb.Tabs) -> dict[str, list[rrb.View]]:
    return {
        str(screen.name): list(views_below(screen))
        for screen in root.contents
        if isinstance(screen, rrb.Container)
    }


def bounds(view: rrb.View) -> tuple[float, float]:
    """Width and height that a view shows, from 0."""
    shown = view.properties["VisualBounds2D"]
    assert isinstance(shown, rrb.VisualBounds2D)
    assert shown.range is not None
    (found,) = shown.range.as_arrow_array().to_pylist()
    (left, right), (top, bottom) = found["x_range"], found["y_range"]
    assert (left, top) == (0.0, 0.0)
    return right, bottom


def test_every_view_has_a_part_of_the_recording_of_a_session(recorded: Recorded) -> None:
    contents = Contents(recorded.recording)
    found = layout_views(recorded.recording)
    assert len(found) > 20
    for view in found:
        assert contents.below(view.origin), view.name


def test_a_session_opens_with_the_screen_of_its_last_phase(recorded: Recorded) -> None:
    assert front_tab(recorded.recording) == TRIAL


@pytest.mark.parametrize(
    ("phase", "front"), [("capture", "Captures"), ("fit", "Calibration: which standoff?"), ("trial", "round")]
)
def test_the_screen_in_front_is_that_of_the_phase(phase: Phase, front: str) -> None:
    root = screens(a_rig(), TRIALS, phase)
    assert isinstance(root.active_tab, int)
    screen = list(root.contents)[root.active_tab]
    assert isinstance(screen, rrb.Container)
    assert screen.name == front


def test_there_is_a_screen_for_each_trial_between_the_fit_and_the_bench() -> None:
    assert list(by_screen(screens(a_rig()))) == [*SCREENS, "3D"]
    assert list(by_screen(screens(a_rig(), TRIALS))) == [*SCREENS, "accuracy", "round", "3D"]


def test_frame_spots_and_text_of_the_cursor_are_on_every_screen_with_charts_over_standoffs() -> None:
    found = by_screen(screens(a_rig(), TRIALS))
    for name in ("Captures", "Calibration: which standoff?", "accuracy", "round"):
        assert {view.origin for view in found[name]} >= {"frame", "crops", "now"}


def test_every_chart_of_a_trial_has_a_view_named_by_its_title() -> None:
    origins = {view.name: view.origin for view in by_screen(screens(a_rig(), TRIALS))["round"]}
    assert origins["First"] == "trials/round/pictures/one"
    assert origins["Second"] == "trials/round/pictures/two"


def test_views_of_pictures_show_all_of_them() -> None:
    rig = a_rig()
    camera = rig.camera.model_copy(update={"width_px": 1024, "height_px": 768})
    lasers = (*rig.lasers, rig.lasers[0].model_copy(update={"id": "L5"}))
    found = by_screen(screens(rig.model_copy(update={"camera": camera, "lasers": lasers}), TRIALS))
    for views in found.values():
        for view in views:
            if view.name == FRAME_VIEW:
                assert bounds(view) == (1024.0, 768.0)
            elif view.name == CROPS_VIEW:
                assert bounds(view) == tuple(map(float, mosaic_size(5)))
            elif "picture" in str(view.origin):
                assert bounds(view) == tuple(map(float, SIZE_PX))


def test_curves_and_residuals_are_along_the_lasers_line() -> None:
    rig = a_rig()
    upright = tuple(
        laser.model_copy(update={"axis": "v", "x_mm": prior(0.0, 0.2), "y_mm": laser.x_mm})
        for laser in rig.lasers
    )
    level, vertical = (
        {view.origin for view in views}
        for one in (rig, rig.model_copy(update={"lasers": upright}))
        for name, views in by_screen(screens(one)).items()
        if name == SCREENS[1]
    )
    assert {"fit/picture/u", "fit/residuals_in_sd/u"} <= level - vertical
    assert {"fit/picture/v", "fit/residuals_in_sd/v"} <= vertical - level


def test_the_peaks_are_shown_up_to_full_scale() -> None:
    rig = a_rig()
    wide = rig.model_copy(update={"camera": rig.camera.model_copy(update={"bits": 12})})
    (peaks,) = (view for view in by_screen(screens(wide))["Captures"] if view.origin == "spots/peak_dn")
    axis = peaks.properties["ScalarAxis"]
    assert isinstance(axis, rrb.ScalarAxis)
    assert axis.range is not None
    assert axis.range.as_arrow_array().to_pylist() == [[0.0, 4096.0]]


def test_a_session_that_does_not_calibrate_has_no_screens_of_a_fit() -> None:
    root = blueprint(a_rig(), TRIALS, "trial", calibrates=False).root_container
    assert isinstance(root, rrb.Tabs)
    found = by_screen(root)
    assert list(found) == ["Captures", "accuracy", "round", "3D"]
    assert not any(
        str(view.origin).startswith(("fit", "progress")) for views in found.values() for view in views
    )
    assert isinstance(root.active_tab, int)
    assert list(found)[root.active_tab] == "round"


def test_the_task_is_shown_on_the_screens_of_a_running_session_only() -> None:
    for live in (True, False):
        root = blueprint(a_rig(), TRIALS, live=live).root_container
        assert isinstance(root, rrb.Tabs)
        found = by_screen(root)
        for name in ("Captures", "Calibration: which standoff?", "accuracy", "round"):
            assert ("task" in {view.origin for view in found[name]}) == live


def test_a_session_without_captures_has_no_frames() -> None:
    """As a simulation, whose charts fill the screen."""
    charts = tuple((f"c{n}", f"Chart {n}") for n in range(5))
    trials = [TrialTab("simulation", charts, reads=False)]
    root = blueprint(a_rig(), trials, "trial", captures=False, calibrates=False).root_container
    assert isinstance(root, rrb.Tabs)
    found = by_screen(root)
    assert list(found) == ["Steps", "simulation"]
    assert root.active_tab == 1
    origins = {str(view.origin) for views in found.values() for view in views}
    assert origins >= {f"trials/simulation/pictures/{name}" for name, _ in charts}
    assert not origins & {"frame", "crops", "bench", "spots/peak_dn"}
