"""Recording of a calibration file: uncertainty of its ranges, parameters, verdict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.model.calibration import Calibration
from workbench.model.chart import Axis, Chart, LimitLine, Series
from workbench.model.fit_tables import calibration_parameter_table
from workbench.sensor.calibrated import CalibratedSensor
from workbench.viewer import blueprint as layout
from workbench.viewer import entities as at
from workbench.viewer.chart import log_chart
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

PICTURE = "calibration/uncertainty"
TABLE = "calibration/parameters"
VERDICT = "calibration/verdict"
RANGES_MM = np.geomspace(100.0, 5000.0, 60)
PERCENT = 100.0


def record_calibration(calibration: Calibration, name: str, out: Path) -> Path:
    """Write the recording of a calibration; returns its path."""
    stream = Stream(out, name, _layout())
    stream.at(Moment(0, 0, 0))
    sensor = CalibratedSensor(calibration)
    log_chart(stream, PICTURE, uncertainty_chart(sensor), at.laser_colors(sensor.ids), "no spot in the image")
    table = calibration_parameter_table(calibration.laser_ranger.parameters)
    stream.log_static_text(TABLE, table_text(table))
    stream.log_static_text(VERDICT, verdict_text(calibration), rr.MediaType.MARKDOWN)
    stream.close()
    return out


def uncertainty_chart(sensor: CalibratedSensor) -> Chart:
    """Relative standard uncertainty of a single range, in per cent, a line for each laser."""
    series = []
    for laser in sensor.ids:
        with np.errstate(invalid="ignore", over="ignore"):  # spots outside the image
            sd = np.where(
                sensor.in_frame(laser, RANGES_MM), sensor.relative_range_sd(laser, RANGES_MM), np.nan
            )
        series.append(
            Series(name=laser, x=tuple(RANGES_MM.tolist()), y=tuple((PERCENT * sd).tolist()), style="line")
        )
    limit = sensor.calibration.laser_ranger.validity.max_relative_range_sd
    return Chart(
        name="uncertainty",
        title="Standard uncertainty of a single range",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="u", unit="%"),
        series=tuple(series),
        limits=(LimitLine(name="largest within the validity", y=PERCENT * limit),),
    )


def verdict_text(calibration: Calibration) -> str:
    """Verdict, validity and origin of a calibration in Markdown."""
    ranger = calibration.laser_ranger
    nearest, farthest = ranger.validity.standoff_mm
    lines = [
        f"**Calibration of {ranger.provenance.rig} {ranger.provenance.serial}: {ranger.fit.verdict}**",
        f"Valid from {nearest:g} to {farthest:g} mm; {ranger.fit.rms_px:.3f} px rms over"
        f" {ranger.fit.observations} spots, {ranger.fit.rejected} not used.",
        f"Made {ranger.provenance.created} by {ranger.provenance.operator}, {ranger.provenance.session}.",
        *(f"- {line}" for line in (*ranger.fit.reasons, *ranger.fit.warnings)),
    ]
    return "\n\n".join(lines)


def _layout() -> rrb.Blueprint:
    texts = rrb.Vertical(
        rrb.TextDocumentView(origin=VERDICT, name="Verdict", titlebar=False),
        rrb.TextDocumentView(origin=TABLE, name="Parameters", titlebar=False, format_options=layout.TEXT),
        row_shares=[2, 3],
    )
    chart = layout.picture_view(PICTURE, "Uncertainty of ranges")
    return rrb.Blueprint(
        rrb.Horizontal(chart, texts, column_shares=[11, 9]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )
