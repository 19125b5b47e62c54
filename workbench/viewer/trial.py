"""A trial: the error of every reading as it is taken, then the tables and charts of its results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import rerun as rr

from workbench.model.chart import Chart
from workbench.model.event import ReadingTaken, TrialFinished, TrialProgress
from workbench.model.reading_chart import SENSOR, error_chart
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import log_chart
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import table_text

NO_TRIAL = "no trial yet"


@dataclass
class TrialView:
    """Readings of one trial as they come."""

    stream: Stream
    colors: Mapping[str, at.Rgb]
    readings: list[ReadingTaken] = field(default_factory=list)

    def log_none_yet(self) -> None:
        """Say so where the trial will be shown."""
        self._log_errors()
        self._document(NO_TRIAL)

    def take(self, reading: ReadingTaken) -> None:
        """Log one reading. The chart follows once a standoff: its bytes would otherwise grow squared."""
        if self.readings and reading.trial != self.readings[-1].trial:
            self.readings.clear()
        elif self.readings and reading.standoff_mm != self.readings[-1].standoff_mm:
            self._log_errors()
            self._document(f"Trial {reading.trial}\n\n{len(self.readings)} readings so far.")
        self.readings.append(reading)
        log_errors(self.stream, reading, self.colors)

    def progress(self, trial: TrialProgress) -> None:
        """Log the charts of a part of a trial."""
        for chart in trial.charts:
            self._log(at.TRIAL_CHART, chart)

    def finish(self, trial: TrialFinished) -> None:
        """Log the tables, the readings without a range, and the charts, the first in front."""
        if trial.charts:
            self._log(at.TRIAL_CHART, trial.charts[0])
        else:
            self.stop()
        for chart in trial.charts[1:]:
            self._log(at.under(at.TRIAL_CHARTS, chart.name), chart)
        parts = [
            f"Trial {trial.trial}",
            *map(table_text, trial.tables),
            documents.without_range(self.readings),
        ]
        self._document("\n\n".join(part for part in parts if part))

    def stop(self) -> None:
        """The session ends: show what there is."""
        if self.readings:
            self._log_errors()

    def _log_errors(self) -> None:
        self._log(at.TRIAL_CHART, error_chart("errors", self.readings))

    def _log(self, entity: str, chart: Chart) -> None:
        log_chart(self.stream, entity, chart, {**self.colors, SENSOR: at.WHITE}, NO_TRIAL)

    def _document(self, text: str) -> None:
        self.stream.log(at.TRIAL_SUMMARY, rr.TextDocument(text, media_type=rr.MediaType.TEXT))


def log_errors(stream: Stream, reading: ReadingTaken, colors: Mapping[str, at.Rgb]) -> None:
    """Errors (measured - true, mm) of a reading and of its lasers, with a band of the stated one sigma."""
    if reading.range_mm is not None:
        _log_error(stream, SENSOR, reading.range_mm - reading.standoff_mm, reading.sigma_mm, at.WHITE)
    for one in reading.lasers:
        color = colors.get(one.laser_id, at.WHITE)
        _log_error(stream, one.laser_id, one.range_mm - reading.standoff_mm, one.sigma_mm, color)


def _log_error(stream: Stream, who: str, error_mm: float, sigma_mm: float | None, color: at.Rgb) -> None:
    variances = None if sigma_mm is None else [sigma_mm**2]
    error = rr.Measurements(values=[error_mm], variances=variances, units="mm", names=who, colors=color)
    stream.log(at.under(at.TRIAL_ERRORS, who), error)
