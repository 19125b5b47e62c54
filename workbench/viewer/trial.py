"""View of a trial: the error of every reading live, then the tables and charts of its results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import rerun as rr

from workbench.model.chart import Chart
from workbench.model.event import ReadingTaken, TrialFinished
from workbench.model.reading_chart import SENSOR, error_chart
from workbench.model.rig import Rig
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.blueprint import blueprint
from workbench.viewer.chart import log_chart
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import table_text

NO_TRIAL = "no trial yet"


@dataclass
class TrialView:
    """View of the readings and results of one trial."""

    stream: Stream
    rig: Rig
    colors: Mapping[str, at.Rgb]
    readings: list[ReadingTaken] = field(default_factory=list)
    laid_out: list[tuple[str, str]] = field(default_factory=list)
    """Names and titles of the charts with their own views; empty if there is only the live chart."""

    def log_none_yet(self) -> None:
        """Log a note in each view of the trial."""
        self._log_errors()
        self._document(NO_TRIAL)

    def take(self, reading: ReadingTaken) -> None:
        """Log one reading. The chart is drawn once per standoff, or its size would grow quadratically."""
        if self.readings and reading.trial != self.readings[-1].trial:
            self.readings.clear()
        elif self.readings and reading.standoff_mm != self.readings[-1].standoff_mm:
            self._log_errors()
            self._document(f"Trial {reading.trial}\n\n{len(self.readings)} readings so far.")
        self.readings.append(reading)
        log_errors(self.stream, reading, self.colors)

    def finish(self, trial: TrialFinished) -> None:
        """Log tables, readings without a range, and charts, replacing those of an earlier trial."""
        self.stream.log(at.TRIAL_CHARTS, rr.Clear(recursive=True))
        if not trial.charts:
            self.stop()
        places = at.trial_charts([chart.name for chart in trial.charts])
        for place, chart in zip(places, trial.charts, strict=True):
            self._log(place, chart)
        self._lay_out(trial.charts)
        parts = [
            f"Trial {trial.trial}",
            *map(table_text, trial.tables),
            documents.without_range(self.readings),
        ]
        self._document("\n\n".join(part for part in parts if part))
        self.readings.clear()  # otherwise `stop` would draw them over the first chart

    def stop(self) -> None:
        """Log the readings so far at the end of the session."""
        if self.readings:
            self._log_errors()

    def _lay_out(self, charts: Sequence[Chart]) -> None:
        """Lay out one view per chart, unless the layout fits already: the user may have changed it."""
        titles = [(chart.name, chart.title) for chart in charts] if len(charts) > 1 else []
        if titles != self.laid_out:
            self.stream.lay_out(blueprint(self.rig, charts))
            self.laid_out = titles

    def _log_errors(self) -> None:
        self._log(at.TRIAL_CHART, error_chart("errors", self.readings))

    def _log(self, entity: str, chart: Chart) -> None:
        log_chart(self.stream, entity, chart, {**self.colors, SENSOR: at.WHITE}, NO_TRIAL)

    def _document(self, text: str) -> None:
        self.stream.log(at.TRIAL_SUMMARY, rr.TextDocument(text, media_type=rr.MediaType.TEXT))


def log_errors(stream: Stream, reading: ReadingTaken, colors: Mapping[str, at.Rgb]) -> None:
    """Log errors (measured - true, mm) of a reading and of its lasers, with their stated 1 sigma."""
    if reading.error_mm is not None:
        _log_error(stream, SENSOR, reading.error_mm, reading.sigma_mm, at.WHITE)
    for one in reading.lasers if reading.true is None else ():
        color = colors.get(one.laser_id, at.WHITE)
        _log_error(stream, one.laser_id, one.range_mm - reading.standoff_mm, one.sigma_mm, color)


def _log_error(stream: Stream, name: str, error_mm: float, sigma_mm: float | None, color: at.Rgb) -> None:
    variances = None if sigma_mm is None else [sigma_mm**2]
    error = rr.Measurements(values=[error_mm], variances=variances, units="mm", names=name, colors=color)
    stream.log(at.under(at.TRIAL_ERRORS, name), error)
