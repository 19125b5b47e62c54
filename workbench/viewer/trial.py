"""A trial: the error of every reading with its stated standard deviation, and the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import rerun as rr

from workbench.model.event import ReadingTaken, TrialFinished
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import Chart, Mark, log_chart
from workbench.viewer.stream import Stream

PERCENT = 100.0


@dataclass
class Trial:
    """Readings of one trial as they come."""

    stream: Stream
    colors: Mapping[str, at.Rgb]
    readings: list[ReadingTaken] = field(default_factory=list)

    def log_none_yet(self) -> None:
        """Say so where the trial will be shown."""
        self._log_chart()
        self._document("# No trial yet")

    def take(self, reading: ReadingTaken) -> None:
        """Log one reading. The chart follows once a standoff: its bytes would otherwise grow squared."""
        if self.readings and reading.trial != self.readings[-1].trial:
            self.readings.clear()
        elif self.readings and reading.standoff_mm != self.readings[-1].standoff_mm:
            self._log_chart()
            self._document(f"# Trial {reading.trial}\n\n{len(self.readings)} readings so far.")
        self.readings.append(reading)
        log_errors(self.stream, reading, self.colors)

    def finish(self, trial: TrialFinished) -> None:
        """Log the table, and the chart of all readings."""
        self._log_chart()
        self._document(documents.trial_table(trial, self.readings))

    def stop(self) -> None:
        """The session ends: show what there is."""
        if self.readings:
            self._log_chart()

    def _log_chart(self) -> None:
        colors = {**self.colors, at.SENSOR: at.WHITE}
        log_chart(self.stream, at.TRIAL_CHART, Chart("%", error_marks(self.readings), colors), "no trial yet")

    def _document(self, text: str) -> None:
        self.stream.log(at.TRIAL_SUMMARY, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))


def log_errors(stream: Stream, reading: ReadingTaken, colors: Mapping[str, at.Rgb]) -> None:
    """Errors (measured - true, mm) of a reading and of its lasers, with a band of the stated one sigma."""
    if reading.range_mm is not None:
        _log_error(stream, at.SENSOR, reading.range_mm - reading.standoff_mm, reading.sigma_mm, at.WHITE)
    for one in reading.lasers:
        color = colors.get(one.laser_id, at.WHITE)
        _log_error(stream, one.laser_id, one.range_mm - reading.standoff_mm, one.sigma_mm, color)


def _log_error(stream: Stream, who: str, error_mm: float, sigma_mm: float | None, color: at.Rgb) -> None:
    variances = None if sigma_mm is None else [sigma_mm**2]
    error = rr.Measurements(values=[error_mm], variances=variances, units="mm", names=who, colors=color)
    stream.log(at.under(at.TRIAL_ERRORS, who), error)


def error_marks(readings: Sequence[ReadingTaken]) -> list[Mark]:
    """Relative errors of all readings and of their lasers, in percent of the true range."""
    marks = []
    for reading in readings:
        true_mm = reading.standoff_mm
        ranges = [(one.laser_id, one.range_mm, one.sigma_mm) for one in reading.lasers]
        if reading.range_mm is not None and reading.sigma_mm is not None:
            ranges.append((at.SENSOR, reading.range_mm, reading.sigma_mm))
        marks += [
            Mark(who, true_mm, PERCENT * (r / true_mm - 1), PERCENT * sd / true_mm) for who, r, sd in ranges
        ]
    return marks
