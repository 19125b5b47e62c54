"""Layout of a recording in the viewer.

One screen for each phase of a session: captures as they come, the result of the calibration, each trial. All
have the frame and the spots at the time cursor at the top. What is wrong in a chart and what the camera saw
are so on one screen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import rerun as rr
import rerun.blueprint as rrb

from workbench.figures.picture import SIZE_PX, SMALL_PX
from workbench.model.rig import Rig, nearest_image_axis
from workbench.viewer import entities as at
from workbench.viewer.crops import mosaic_size

FRAME_VIEW = "Frame, stretched"
CROPS_VIEW = "Spots: lit minus dark | remainder"
Phase = Literal["capture", "fit", "trial"]
"""Screen in front: captures, result of the fit, the last trial."""
PLAYED_PER_SECOND = 10.0
"""Captures per second when a recording is played."""
TEXT = rrb.archetypes.TextDocumentFormat(monospace=True, word_wrap=False)
"""Format of tables in plain text."""
PER_PAGE = 2
"""Number of charts of a trial without readings on one screen."""
WHOLE_TIME = rrb.TimeAxis(
    view_range=rr.TimeRange(start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite())
)
DARK = [18, 20, 22]


@dataclass(frozen=True)
class TrialTab:
    """One trial in the layout."""

    trial: str
    """Name of the step."""
    charts: tuple[tuple[str, str], ...]
    """Name and title of each chart."""
    reads: bool = True
    """Whether it takes readings; a simulation or a comparison of trials takes none."""
    errors_mm: tuple[float, float] | None = None
    """Ends of the axis of the readings' errors, with their uncertainty; None: by Rerun, without it."""


def blueprint(
    rig: Rig,
    trials: Sequence[TrialTab] = (),
    phase: Phase = "capture",
    *,
    captures: bool = True,
    calibrates: bool = True,
    live: bool = False,
    world: bool = False,
) -> rrb.Blueprint:
    """Layout for one rig; the time cursor follows new data.

    Args:
        rig: rig with the camera and the lasers.
        trials: trials so far, in order.
        phase: screen in front.
        captures: whether the session captures; a simulation does not.
        calibrates: whether the session calibrates; if not, there are no screens of a fit.
        live: whether the session is running, so that the present step and the open prompt are shown.
        world: whether the sensor is driven through a world.
    """
    fit = [_result(rig, live), _parameters()] if calibrates else []
    before = [_captures(rig, calibrates, live) if captures else _steps(live), *fit]
    views = [*([_bench()] if captures else []), *([_world(rig)] if world else [])]
    screens = [*before, *(_trial(rig, one, live) for one in trials), *views]
    front = {"capture": 0, "fit": 1, "trial": len(before) + len(trials) - 1}[phase]
    return rrb.Blueprint(
        rrb.Tabs(*screens, active_tab=front),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=at.CAPTURE, play_state="following", fps=PLAYED_PER_SECOND),
        auto_layout=False,
        auto_views=False,
    )


def comparison(columns: Mapping[str, tuple[Rig, str]]) -> rrb.Blueprint:
    """Layout of several recordings side by side, with the time cursor on the standoff.

    Args:
        columns: rig and title of each recording by the prefix of its entities.
    """
    sides = [_side(prefix, rig, title) for prefix, (rig, title) in columns.items()]
    return rrb.Blueprint(
        rrb.Horizontal(*sides, name="Comparison"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=at.STANDOFF),
        auto_layout=False,
        auto_views=False,
    )


def results_layout(name: str, charts: Sequence[tuple[str, str]]) -> rrb.Blueprint:
    """Layout of results without a session: charts at the left, tables at the right.

    Args:
        name: name of the results.
        charts: name and title of each chart.
    """
    return rrb.Blueprint(
        _charts_and_tables(TrialTab(name, tuple(charts), reads=False), live=False),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def _side(prefix: str, rig: Rig, title: str) -> rrb.Container:
    axis, below = nearest_image_axis(rig.lasers[0]), f"{prefix}/"
    results = rrb.Tabs(
        rrb.TextDocumentView(origin=f"{below}{at.FIT_VERDICT}", name="Verdict"),
        table_view(f"{below}{at.FIT_WORST}", "Worst placements", titlebar=True),
        active_tab=0,
    )
    texts = rrb.Horizontal(text_view(f"{below}{at.NOW}", "Now"), results, column_shares=[5, 11])
    return rrb.Vertical(
        rrb.Horizontal(frame_view(rig, below, f"{title}: frame"), crops_view(rig, below, "Spots")),
        picture_view(f"{below}{at.FIT_PICTURE}/{axis}", f"{title}: residuals along {axis}"),
        texts,
        row_shares=[4, 4, 3],
    )


def _captures(rig: Rig, calibrates: bool, live: bool) -> rrb.Container:
    """Screen of the technician: what is captured now, and how the uncertainty decreases."""
    axis = f"{nearest_image_axis(rig.lasers[0])}_px"
    texts = _texts(live, (_log(), 4))
    brightness = rrb.Vertical(
        curves_view(f"{at.SPOTS}/peak_dn", "Peak of each spot [DN]", y=(0.0, 2.0**rig.camera.bits)),
        curves_view(at.AMBIENT, "Ambient light [DN]"),
        row_shares=[3, 2],
    )
    progress = rrb.Tabs(
        picture_view(at.UNCERTAINTY, "Uncertainty", SMALL_PX),
        picture_view(at.NARROWING, "Parameters", SMALL_PX),
        _series(at.ADVICE, "Largest [%]"),
        active_tab=0,
    )
    curves = rrb.Horizontal(
        brightness,
        curves_view(f"{at.SPOTS}/{axis}", f"Spot position {axis[0]} [px]"),
        *([progress] if calibrates else []),
        rrb.StateTimelineView(origin=at.LANES, name="Steps"),
        column_shares=[3, 3, *([5] if calibrates else []), 4],
    )
    return rrb.Vertical(_seen(rig, texts, (8, 9, 11)), curves, row_shares=[9, 8], name="Captures")


def _steps(live: bool) -> rrb.Container:
    """Screen of a session without captures."""
    lanes = rrb.StateTimelineView(origin=at.LANES, name="Steps")
    return rrb.Horizontal(_texts(live, (_log(), 4)), lanes, name="Steps")


def _log() -> rrb.View:
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(origin=at.STEP_LOG, name="Log", columns=columns)


def _result(rig: Rig, live: bool) -> rrb.Container:
    """Screen of the engineer: which standoff is bad, and what the camera saw there."""
    axis = nearest_image_axis(rig.lasers[0])
    texts = _texts(
        live,
        (text_view(at.FIT_VERDICT, "Verdict"), 6),
        (table_view(at.FIT_WORST, "Worst"), 6),
    )
    charts = rrb.Horizontal(
        picture_view(f"{at.FIT_PICTURE}/{axis}", f"Residuals along {axis}"),
        _series(
            f"{at.FIT_RESIDUALS_IN_SD}/{axis}",
            "Residual in sd; right click: go to the capture",
            time=WHOLE_TIME,
        ),
        column_shares=[10, 5],
    )
    return rrb.Vertical(_seen(rig, texts), charts, row_shares=[5, 4], name="Calibration: which standoff?")


def _parameters() -> rrb.Container:
    charts = rrb.Vertical(*(picture_view(f"{at.FIT_PICTURE}/{axis}", f"Residuals {axis}") for axis in "uv"))
    texts = rrb.Tabs(
        table_view(at.FIT_CHECKS, "Checks", titlebar=True),
        table_view(at.FIT_TABLE, "Fitted parameters", titlebar=True),
        active_tab=0,
    )
    return rrb.Horizontal(charts, texts, column_shares=[1, 1], name="Calibration: details")


def _trial(rig: Rig, trial: TrialTab, live: bool) -> rrb.Container:
    if not trial.reads:
        return _charts_and_tables(trial, live)
    tables, pictures = _parts(trial)
    texts = _texts(live, (tables, 8))
    charts = rrb.Horizontal(
        pictures[0] if len(pictures) == 1 else rrb.Tabs(*pictures, active_tab=0),
        _series(
            at.trial_errors(trial.trial),
            "Error [mm], u shaded; right click: go to the reading",
            y=trial.errors_mm,
        ),
        column_shares=[10, 5],
    )
    return rrb.Vertical(_seen(rig, texts, (6, 7, 13), (5, 2)), charts, row_shares=[5, 4], name=trial.trial)


def _charts_and_tables(trial: TrialTab, live: bool) -> rrb.Container:
    """Screen of results without readings."""
    tables, pictures = _parts(trial)
    shown = [_page(n + 1, pictures[n : n + PER_PAGE]) for n in range(0, len(pictures), PER_PAGE)]
    if not shown:
        return _texts(live, (tables, 8))
    return rrb.Horizontal(
        shown[0] if len(shown) == 1 else rrb.Tabs(*shown, active_tab=0),
        _texts(live, (tables, 8)),
        column_shares=[1, 1],
        name=trial.trial,
    )


def _parts(trial: TrialTab) -> tuple[rrb.View, list[rrb.View]]:
    """View of the tables of a trial, and those of its charts."""
    tables = table_view(at.trial_tables(trial.trial), "Tables: scroll, or enlarge", titlebar=True)
    return tables, [picture_view(at.trial_picture(trial.trial, name), title) for name, title in trial.charts]


def _page(first: int, pictures: Sequence[rrb.View]) -> rrb.Container:
    """Charts one below the other, named by their numbers: titles of ten charts do not fit side by side."""
    last = first + len(pictures) - 1
    return rrb.Vertical(*pictures, name=f"Charts {first}, {last}" if last > first else f"Chart {first}")


def _bench() -> rrb.Container:
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=(-330.0, -260.0, -230.0),
        look_target=(0.0, 10.0, 330.0),
        eye_up=(0.0, -1.0, 0.0),
    )
    return rrb.Horizontal(
        rrb.Spatial3DView(
            origin=at.BENCH, name="Bench: depth is drawn relative to the standoff", eye_controls=eye
        ),
        name="3D",
    )


def _world(rig: Rig) -> rrb.Container:
    """Screen of a drive: the world with the vehicle, and the frame at the time cursor."""
    view = rrb.Spatial3DView(
        origin=at.WORLD, name="World: beams, answer over the front (white), of a cone (red)"
    )
    return rrb.Horizontal(view, frame_view(rig), column_shares=[3, 2], name="World")


def _texts(live: bool, *parts: tuple[rrb.View, int]) -> rrb.Container:
    """Column of texts with their shares of its height; above them the present task of a running session."""
    all_parts = [(text_view(at.TASK, "Task"), 3), *parts] if live else list(parts)
    views, shares = zip(*all_parts, strict=True)
    return rrb.Vertical(*views, row_shares=list(shares))


def _seen(
    rig: Rig, texts: rrb.Container, columns: tuple[int, int, int] = (4, 5, 5), rows: tuple[int, int] = (3, 1)
) -> rrb.Container:
    """Upper half of a screen: the frame with the subject of its capture below, the spots, texts.

    Args:
        rig: rig with the camera and the lasers.
        texts: column of texts.
        columns: shares of the width.
        rows: shares of the height of the frame and the subject of its capture.
    """
    frame = rrb.Vertical(frame_view(rig), text_view(at.NOW, "Now"), row_shares=list(rows))
    return rrb.Horizontal(frame, crops_view(rig), texts, column_shares=list(columns))


def frame_view(rig: Rig, prefix: str = "", name: str = FRAME_VIEW) -> rrb.View:
    """View of the frame, with the size of the camera's."""
    bounds = _bounds(rig.camera.width_px, rig.camera.height_px)
    return rrb.Spatial2DView(
        origin=f"{prefix}{at.FRAME}", name=name, visual_bounds=bounds, background=[0, 0, 0]
    )


def crops_view(rig: Rig, prefix: str = "", name: str = CROPS_VIEW) -> rrb.View:
    """View of the crops of all lasers."""
    bounds = _bounds(*mosaic_size(len(rig.lasers)))
    return rrb.Spatial2DView(origin=f"{prefix}{at.CROPS}", name=name, visual_bounds=bounds, background=DARK)


def picture_view(origin: str, name: str, size_px: tuple[int, int] = SIZE_PX) -> rrb.View:
    """View of the picture of a chart."""
    return rrb.Spatial2DView(origin=origin, name=name, visual_bounds=_bounds(*size_px), background=DARK)


def _series(
    origin: str,
    name: str,
    time: rrb.TimeAxis | None = None,
    y: tuple[float, float] | None = None,
) -> rrb.View:
    """View of series without a legend, which would cover them: the picture beside it has the same colours."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=time,
        axis_y=None if y is None else rrb.ScalarAxis(range=y),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def curves_view(
    origin: str, name: str, y: tuple[float, float] | None = None, shown: rrb.VisibleTimeRange | None = None
) -> rrb.View:
    """View of narrow curves without a legend, which would cover them: the spots above name the colours."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_y=None if y is None else rrb.ScalarAxis(range=y),
        plot_legend=rrb.PlotLegend(visible=False),
        time_ranges=shown,
    )


def text_view(origin: str, name: str) -> rrb.View:
    """View of a text in Markdown."""
    return rrb.TextDocumentView(origin=origin, name=name, titlebar=False)


def table_view(origin: str, name: str, *, titlebar: bool = False) -> rrb.View:
    """View of tables in plain text."""
    return rrb.TextDocumentView(origin=origin, name=name, titlebar=titlebar, format_options=TEXT)


def _bounds(width: float, height: float) -> rrb.VisualBounds2D:
    return rrb.VisualBounds2D(x_range=(0.0, float(width)), y_range=(0.0, float(height)))
