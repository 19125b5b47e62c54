"""View of a fit: parameters, residuals against standoff, summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import rerun as rr

from workbench.model.event import FitFinished, ParameterRecord, ResidualRecord
from workbench.model.fit_charts import residual_chart
from workbench.model.fit_tables import cross_validation_table, parameter_table, term_table
from workbench.model.rig import ImageAxis
from workbench.model.table import Table
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import log_chart, log_note
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

AXES: tuple[ImageAxis, ...] = get_args(ImageAxis)


def log_no_fit_yet(stream: Stream) -> None:
    """Log a note in each view of the fit, because an empty view could be a defect."""
    for axis in AXES:
        log_note(stream, f"{at.FIT_CHART}/{axis}", "no fit yet")
    for entity in (at.FIT_SUMMARY, at.FIT_CHECKS, at.FIT_TABLE):
        _log_text(stream, entity, "No fit yet")


def log_fit(stream: Stream, fit: FitFinished, moment: Moment, colors: Mapping[str, at.Rgb]) -> None:
    """Log parameters, residuals, tables and summary of a fit."""
    for parameter in fit.parameters:
        _log_parameter(stream, parameter)
    for axis in AXES:
        chart = residual_chart(fit, axis)
        log_chart(stream, f"{at.FIT_CHART}/{axis}", chart, colors, f"{axis} was not measured")
    summary = rr.TextDocument(documents.fit_summary(fit), media_type=rr.MediaType.MARKDOWN)
    stream.log(at.FIT_SUMMARY, summary)
    _log_tables(stream, at.FIT_CHECKS, cross_validation_table(fit.left_out), term_table(fit.terms))
    _log_tables(stream, at.FIT_TABLE, parameter_table(fit.parameters))
    for residual in fit.residuals:
        stream.at(Moment(moment.capture, moment.step, moment.time_ns, residual.standoff_mm))
        _log_residual(stream, residual)
    stream.at(moment)


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
    """Log a residual as numbers, also on the standoff timeline, which plots them against standoff."""
    values = {"u_px": one.u_px, "v_px": one.v_px, "u_sd_px": one.u_sd_px, "v_sd_px": one.v_sd_px}
    for name, value in values.items():
        if value is not None:
            stream.log(at.under(at.FIT_RESIDUALS, name, one.laser_id), rr.Scalars(value))


def _log_tables(stream: Stream, entity: str, *tables: Table) -> None:
    """Log the tables that have rows, one below the other."""
    texts = [table_text(table) for table in tables if table.rows]
    _log_text(stream, entity, "\n\n\n".join(texts) or "Nothing was checked")


def _log_text(stream: Stream, entity: str, text: str) -> None:
    stream.log(entity, rr.TextDocument(text, media_type=rr.MediaType.TEXT))
