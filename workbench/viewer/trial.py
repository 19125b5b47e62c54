"""View of a trial: the error of every reading live, then the tables and charts of its results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import rerun as rr

from workbench.figures.picture import Picture
from workbench.model.chart import Chart
from workbench.model.event import ReadingTaken, TrialFinished
from workbench.model.number_text import counted
from workbench.model.reading_chart import SENSOR, error_chart
from workbench.model.reading_text import reading_remark
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.blueprint import TrialTab
from workbench.viewer.chart import log_chart, log_cursor
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

LIVE_CHART = "errors"
NO_READING = "no reading yet"
MARGIN, LEAST_MARGIN_MM = 0.05, 0.01
"""Blank at each end of the axis of errors, as a share of them, and at least."""


@dataclass
class TrialView:
    """View of the readings and results of one trial; its entities are below the name of the trial."""

    stream: Stream
    colors: Mapping[str, at.Rgb]
    trial: str
    readings: list[ReadingTaken] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)
    """Moment of each reading."""
    charts: tuple[Chart, ...] = ()
    """Charts of the results; empty before the trial has finished."""

    @property
    def tab(self) -> TrialTab:
        """The trial's part of the layout."""
        charts = [(chart.name, chart.title or chart.name) for chart in self.charts]
        reads = bool(self.readings) or not self.charts
        ends_mm = error_ends_mm(self.readings) if self.charts else None
        return TrialTab(self.trial, tuple(charts) or ((LIVE_CHART, "Errors so far"),), reads, ends_mm)

    def start(self) -> None:
        """Log notes in the views that the first reading does not fill."""
        self._draw(error_chart(LIVE_CHART, []))
        self._document(NO_READING)

    def take(self, reading: ReadingTaken, moment: Moment) -> None:
        """Log one reading. The chart is drawn once per standoff."""
        if self.readings and reading.standoff_mm != self.readings[-1].standoff_mm:
            self._so_far()
        self.stream.at(moment)
        self.readings.append(reading)
        self.moments.append(moment)
        log_errors(self.stream, at.trial_errors(self.trial), reading, self.colors)

    def finish(self, results: TrialFinished) -> None:
        """Log tables, readings without a range, and charts; without charts the errors of all readings."""
        self.charts = results.charts or (error_chart(LIVE_CHART, self.readings),)
        for chart in self.charts:
            self._draw(chart)
        parts = [*map(table_text, results.tables), documents.without_range(self.readings)]
        self._document("\n\n".join(part for part in parts if part))

    def stop(self) -> None:
        """Log the readings so far at the end of a session that ends before the trial."""
        if self.readings and not self.charts:
            self._so_far()

    def _so_far(self) -> None:
        self._draw(error_chart(LIVE_CHART, self.readings))
        remarks = [remark for one in self.readings if (remark := reading_remark(one))]
        self._document("\n".join([f"{counted(len(self.readings), 'reading')} so far", *remarks]))

    def _draw(self, chart: Chart) -> None:
        entity = at.trial_picture(self.trial, chart.name)
        drawn = log_chart(self.stream, entity, chart, {**self.colors, SENSOR: at.WHITE}, NO_READING)
        if drawn is not None:
            self._log_cursors(entity, drawn)

    def _log_cursors(self, entity: str, drawn: Picture) -> None:
        """Log the frame around the present reading's points, at the first reading of each value of x."""
        before: float | None = None
        for reading, moment in zip(self.readings, self.moments, strict=True):
            if reading.reference_mm != before:
                self.stream.at(moment)
                log_cursor(self.stream, entity, drawn, reading.reference_mm)
                before = reading.reference_mm

    def _document(self, text: str) -> None:
        self.stream.log_static_text(at.trial_tables(self.trial), text)


def tabs(trials: Sequence[TrialView]) -> list[TrialTab]:
    """Tabs of the trials of a session."""
    return [trial.tab for trial in trials]


def error_ends_mm(readings: Sequence[ReadingTaken]) -> tuple[float, float] | None:
    """Ends of an axis with all errors of readings and of their lasers, each with its stated uncertainty."""
    errors = [(one.error_mm, one.sigma_mm or 0.0) for one in readings if one.error_mm is not None]
    for one in readings:
        sigmas_mm = {laser.laser_id: laser.sigma_mm for laser in one.lasers}
        errors += [(error_mm, sigmas_mm[laser]) for laser, error_mm in one.laser_errors_mm.items()]
    if not errors:
        return None
    low, high = min(error - sd for error, sd in errors), max(error + sd for error, sd in errors)
    margin = max(MARGIN * (high - low), LEAST_MARGIN_MM)
    return low - margin, high + margin


def log_errors(stream: Stream, parent: str, reading: ReadingTaken, colors: Mapping[str, at.Rgb]) -> None:
    """Log errors (measured - true, mm) of a reading and of its lasers, with their stated 1 sigma."""
    if reading.error_mm is not None:
        _log_error(stream, parent, SENSOR, reading.error_mm, reading.sigma_mm, at.WHITE)
    sigmas_mm = {one.laser_id: one.sigma_mm for one in reading.lasers}
    for laser_id, error_mm in reading.laser_errors_mm.items():
        color = colors.get(laser_id, at.WHITE)
        _log_error(stream, parent, laser_id, error_mm, sigmas_mm[laser_id], color)


def _log_error(
    stream: Stream, parent: str, name: str, error_mm: float, sigma_mm: float | None, color: at.Rgb
) -> None:
    variances = None if sigma_mm is None else [sigma_mm**2]
    error = rr.Measurements(values=[error_mm], variances=variances, units="mm", names=name, colors=color)
    stream.log(at.under(parent, name), error)
