"""View of a fit: verdict, worst placements, residuals against standoff, parameters.

Everything but the numbers on timelines is static: the result is visible wherever the time cursor is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import rerun as rr

from workbench.model.event import FitFinished, ParameterRecord, ResidualRecord
from workbench.model.fit_charts import residual_chart
from workbench.model.fit_tables import (
    cross_validation_table,
    parameter_table,
    term_table,
    worst_placements_table,
)
from workbench.model.rig import ImageAxis
from workbench.model.table import Table
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.captures import CaptureLog
from workbench.viewer.chart import log_chart, log_cursor, log_note
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

MOST_ROWS = 4
"""Number of the worst placements on the screen."""
AXES: tuple[ImageAxis, ...] = get_args(ImageAxis)


def picture_of(axis: ImageAxis) -> str:
    """Entity of the picture of the residuals along an axis."""
    return f"{at.FIT_PICTURE}/{axis}"


def log_series_styles(stream: Stream, colors: Mapping[str, at.Rgb]) -> None:
    """Log name and colour of the residuals' points."""
    for axis in AXES:
        for laser, color in colors.items():
            style = rr.SeriesPoints(colors=color, names=laser, markers="circle", marker_sizes=5.0)
            stream.log(at.under(at.FIT_RESIDUALS_IN_SD, axis, laser), style, static=True)


def log_no_fit_yet(stream: Stream) -> None:
    """Log a note in each view of the fit, because an empty view could be a defect."""
    for axis in AXES:
        log_note(stream, picture_of(axis), "no fit yet")
    stream.log_static_text(at.FIT_VERDICT, "No fit yet", rr.MediaType.MARKDOWN)
    for entity in (at.FIT_WORST, at.FIT_CHECKS, at.FIT_TABLE):
        stream.log_static_text(entity, "No fit yet")


def log_fit(
    stream: Stream, fit: FitFinished, captures: CaptureLog, moment: Moment, colors: Mapping[str, at.Rgb]
) -> None:
    """Log parameters, residuals, tables and summary of a fit."""
    for parameter in fit.parameters:
        _log_parameter(stream, parameter)
    defects = captures.defects()
    stream.log_static_text(at.FIT_VERDICT, documents.fit_summary(fit, defects), rr.MediaType.MARKDOWN)
    worst = worst_placements_table(fit, captures.ranges(), MOST_ROWS)
    _log_tables(stream, at.FIT_WORST, worst)
    _log_tables(stream, at.FIT_CHECKS, defects, cross_validation_table(fit.left_out), term_table(fit.terms))
    _log_tables(stream, at.FIT_TABLE, parameter_table(fit.parameters))
    for axis in AXES:
        _log_residuals(stream, fit, axis, captures, moment, colors)
    for residual in fit.residuals:
        where = captures.first_of(residual.placement, residual.standoff_mm, residual.laser_id)
        stream.at(where or moment)
        _log_residual(stream, residual)
    stream.at(moment)


def _log_residuals(
    stream: Stream,
    fit: FitFinished,
    axis: ImageAxis,
    captures: CaptureLog,
    moment: Moment,
    colors: Mapping[str, at.Rgb],
) -> None:
    """Log the picture of the residuals, with a frame around the standoff that the cursor is at."""
    entity = picture_of(axis)
    drawn = log_chart(stream, entity, residual_chart(fit, axis), colors, f"{axis} was not measured")
    if drawn is None:
        return
    seen = dict.fromkeys((one.placement, one.standoff_mm) for one in fit.residuals)
    visits = [(captures.first_of(*one), one[1]) for one in seen]
    captured = [(first, standoff_mm) for first, standoff_mm in visits if first is not None]
    # In order: of several placements in one step, the timeline of steps shows the last.
    for first, standoff_mm in sorted(captured, key=lambda one: one[0].capture):
        stream.at(first)
        log_cursor(stream, entity, drawn, standoff_mm)
    stream.at(moment)
    log_cursor(stream, entity, drawn, None)


def _log_parameter(stream: Stream, one: ParameterRecord) -> None:
    value = rr.Measurements(values=[one.value], variances=[one.sd**2], units=one.unit, names=one.name)
    uncertainty = rr.AnyValues(
        sd=one.sd,
        prior_value=one.prior_value,
        prior_sd=one.prior_sd,
        data_share=one.data_share,
        determined_by=one.determined_by,
    )
    stream.log(at.under(at.FIT_PARAMETERS, one.name), value, uncertainty)


def _log_residual(stream: Stream, one: ResidualRecord) -> None:
    """Log a residual as numbers, in px and in its standard deviation, at the first capture that it is of."""
    values = {"u_px": one.u_px, "v_px": one.v_px, "u_sd_px": one.u_sd_px, "v_sd_px": one.v_sd_px}
    for name, value in values.items():
        if value is not None:
            stream.log(at.under(at.FIT_RESIDUALS, name, one.laser_id), rr.Scalars(value))
    for axis, value, sd in (("u", one.u_px, one.u_sd_px), ("v", one.v_px, one.v_sd_px)):
        if value is not None and sd:
            stream.log(at.under(at.FIT_RESIDUALS_IN_SD, axis, one.laser_id), rr.Scalars(value / sd))


def _log_tables(stream: Stream, entity: str, *tables: Table) -> None:
    """Log the tables that have rows, one below the other."""
    texts = [table_text(table) for table in tables if table.rows]
    stream.log_static_text(entity, "\n\n".join(texts) or "Nothing was checked")
