"""Layout of a recording in the viewer: one tab for the technician at the bench, three for the engineer."""

from __future__ import annotations

from collections.abc import Sequence

import rerun.blueprint as rrb

from workbench.model.chart import Chart
from workbench.model.reading_chart import SENSOR
from workbench.model.rig import Rig
from workbench.viewer import entities as at
from workbench.viewer.chart import BOUNDS_X, BOUNDS_Y

PICTURE_VIEW = "Picture, lasers on"
"""Name of the view of the frames."""
RESULTS_VIEW = "Results"
TABLE_FORMAT = rrb.archetypes.TextDocumentFormat(monospace=True, word_wrap=False)
"""Format of views of tables in plain text."""


def blueprint(rig: Rig, charts: Sequence[Chart] = ()) -> rrb.Blueprint:
    """Layout for one rig; the technician's tab is in front, and the time cursor follows new data.

    Args:
        rig: rig with the camera and the lasers.
        charts: charts of the last trial in the order of `entities.trial_charts`; several charts get one tab
            each.
    """
    return rrb.Blueprint(
        rrb.Tabs(_live(rig), _fit(), _trial(charts), _bench(), active_tab=0),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=at.CAPTURE, play_state="following"),
        auto_layout=False,
        auto_views=False,
    )


def _live(rig: Rig) -> rrb.Container:
    axis = f"{rig.lasers[0].axis}_px"
    picture = rrb.Spatial2DView(
        origin=at.CAMERA, name=PICTURE_VIEW, visual_bounds=_frame_bounds(rig), background=[0, 0, 0]
    )
    curves = rrb.Vertical(
        rrb.TimeSeriesView(origin=at.STANDOFF_SCALAR, name="Standoff [mm]"),
        rrb.TimeSeriesView(origin=f"{at.SPOTS}/{axis}", name=f"Spot position {axis[0]} [px]"),
        rrb.TimeSeriesView(origin=f"{at.SPOTS}/peak_dn", name="Peak brightness [DN]"),
    )
    activity = rrb.Horizontal(
        rrb.StateTimelineView(origin=at.LANES, name="Steps"),
        rrb.TextLogView(
            origin=at.STEP_LOG, name="Log", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
        ),
    )
    return rrb.Vertical(
        rrb.Horizontal(picture, curves, column_shares=[3, 2]), activity, row_shares=[3, 1], name="Live"
    )


def _fit() -> rrb.Container:
    charts = rrb.Vertical(
        _chart(f"{at.FIT_CHART}/u", "Residuals u"),
        _chart(f"{at.FIT_CHART}/v", "Residuals v"),
    )
    texts = rrb.Vertical(
        rrb.TextDocumentView(origin=at.FIT_SUMMARY, name="Verdict"),
        rrb.TextDocumentView(origin=at.FIT_CHECKS, name="Checks", format_options=TABLE_FORMAT),
        rrb.TextDocumentView(origin=at.FIT_TABLE, name="Parameters", format_options=TABLE_FORMAT),
        row_shares=[2, 3, 3],
    )
    return rrb.Horizontal(charts, texts, column_shares=[3, 2], name="Fit")


def _trial(charts: Sequence[Chart]) -> rrb.Container:
    curves = rrb.Vertical(
        _results(charts),
        rrb.TimeSeriesView(
            origin=f"{at.TRIAL_ERRORS}/{SENSOR}", name="Error of the sensor [mm] during the trial"
        ),
        row_shares=[3, 2],
    )
    table = rrb.TextDocumentView(origin=at.TRIAL_SUMMARY, name="Tables", format_options=TABLE_FORMAT)
    return rrb.Horizontal(curves, table, column_shares=[3, 2], name="Trial")


def _results(charts: Sequence[Chart]) -> rrb.Container | rrb.View:
    """View of the live chart, which becomes the first chart of the results; tabs if there are several."""
    if len(charts) <= 1:
        return _chart(at.TRIAL_CHART, RESULTS_VIEW)
    places = at.trial_charts([chart.name for chart in charts])
    views = [_chart(place, chart.title or chart.name) for place, chart in zip(places, charts, strict=True)]
    return rrb.Tabs(*views, active_tab=0, name=RESULTS_VIEW)


def _bench() -> rrb.Container:
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=(-330.0, -280.0, -400.0),
        look_target=(0.0, 30.0, 700.0),
        eye_up=(0.0, -1.0, 0.0),
    )
    return rrb.Horizontal(
        rrb.Spatial3DView(origin=at.BENCH, name="Bench: rays, target, spots", eye_controls=eye), name="3D"
    )


def _chart(origin: str, name: str) -> rrb.View:
    bounds = rrb.VisualBounds2D(x_range=BOUNDS_X, y_range=BOUNDS_Y)
    return rrb.Spatial2DView(origin=origin, name=name, visual_bounds=bounds, background=[18, 20, 22])


def _frame_bounds(rig: Rig) -> rrb.VisualBounds2D:
    return rrb.VisualBounds2D(
        x_range=(0.0, float(rig.camera.width_px)), y_range=(0.0, float(rig.camera.height_px))
    )
