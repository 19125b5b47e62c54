"""A fit: parameters, residuals against standoff, and its summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import rerun as rr

from workbench.model.event import FitFinished, ParameterRecord, ResidualRecord
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import Chart, Mark, log_chart
from workbench.viewer.stream import Moment, Stream

Axis = Literal["u", "v"]
AXES: tuple[Axis, ...] = ("u", "v")


def log_no_fit_yet(stream: Stream, colors: Mapping[str, at.Rgb]) -> None:
    """Say so where the fit will be shown: an empty view tells nobody whether it is broken."""
    for axis in AXES:
        log_chart(stream, f"{at.FIT_CHART}/{axis}", Chart("px", (), colors), "no fit yet")
    _document(stream, at.FIT_SUMMARY, "# No fit yet")
    _document(stream, at.FIT_CHECKS, "# Nothing to check yet")
    _document(stream, at.FIT_TABLE, "# No parameters yet")


def log_fit(stream: Stream, fit: FitFinished, moment: Moment, colors: Mapping[str, at.Rgb]) -> None:
    """Everything that a fit says."""
    for parameter in fit.parameters:
        _log_parameter(stream, parameter)
    for axis in AXES:
        chart = Chart("px", residual_marks(fit, axis), colors)
        log_chart(stream, f"{at.FIT_CHART}/{axis}", chart, f"{axis} was not measured")
    _document(stream, at.FIT_SUMMARY, documents.fit_summary(fit))
    _document(stream, at.FIT_CHECKS, documents.checks(fit))
    _document(stream, at.FIT_TABLE, documents.parameter_table(fit.parameters))
    for residual in fit.residuals:
        stream.at(Moment(moment.capture, moment.step, moment.time_ns, residual.standoff_mm))
        _log_residual(stream, residual)
    stream.at(moment)


def residual_marks(fit: FitFinished, axis: Axis) -> list[Mark]:
    """The residuals along one image axis that were measured."""
    marks = []
    for one in fit.residuals:
        value, sd = (one.u_px, one.u_sd_px) if axis == "u" else (one.v_px, one.v_sd_px)
        if value is not None:
            marks.append(Mark(one.laser_id, one.standoff_mm, value, sd, expected_sd=sd))
    return marks


def _log_parameter(stream: Stream, one: ParameterRecord) -> None:
    value = rr.Measurements(values=[one.value], variances=[one.sd**2], units=one.unit, names=one.name)
    belief = rr.AnyValues(
        sd=one.sd,
        prior_value=one.prior_value,
        prior_sd=one.prior_sd,
        data_share=one.data_share,
        determined_by=one.determined_by,
    )
    stream.log(at.under(at.FIT_PARAMETERS, one.name), value, belief)


def _log_residual(stream: Stream, one: ResidualRecord) -> None:
    """As numbers, on the standoff timeline too: choosing it in the viewer plots them against standoff."""
    values = {"u_px": one.u_px, "v_px": one.v_px, "u_sd_px": one.u_sd_px, "v_sd_px": one.v_sd_px}
    for name, value in values.items():
        if value is not None:
            stream.log(at.under(at.FIT_RESIDUALS, name, one.laser_id), rr.Scalars(value))


def _document(stream: Stream, entity: str, text: str) -> None:
    stream.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
