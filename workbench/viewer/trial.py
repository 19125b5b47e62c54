"""A trial: the error of every reading with its stated standard deviation, and the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot

import rerun as rr

from workbench.model.event import ReadingTaken, TrialFinished
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import Chart, Mark, log_chart
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import table_text

PERCENT = 100.0


@dataclass
class TrialView:
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
        """Log the tables, the readings without a range, and the charts."""
        self._log_chart()
        parts = [table_text(table) for table in trial.tables]
        self._document("\n\n".join([*parts, *documents.without_range(self.readings)]))

    def stop(self) -> None:
        """The session ends: show what there is."""
        if self.readings:
            self._log_chart()

    def _log_chart(self, reference_sd_mm: Mapping[float, float] | None = None) -> None:
        colors = {**self.colors, at.SENSOR: at.WHITE}
        marks = error_marks(self.readings, reference_sd_mm or {})
        log_chart(self.stream, at.TRIAL_CHART, Chart("%", marks, colors), "no trial yet")

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


def error_marks(readings: Sequence[ReadingTaken], reference_sd_mm: Mapping[float, float]) -> list[Mark]:
    """Relative errors of all readings and of their lasers, in percent of the true range.

    `reference_sd_mm` says for each standoff how well its true range is known. That is part of the error but
    not of what the sensor states, so only where it is known can an error be called too large.
    """
    return [mark for reading in readings for mark in _marks_of(reading, reference_sd_mm)]


def _marks_of(reading: ReadingTaken, reference_sd_mm: Mapping[float, float]) -> list[Mark]:
    true_mm = reading.standoff_mm
    reference = reference_sd_mm.get(true_mm)
    ranges = [(one.laser_id, one.range_mm, one.sigma_mm) for one in reading.lasers]
    if reading.range_mm is not None and reading.sigma_mm is not None:
        ranges.append((at.SENSOR, reading.range_mm, reading.sigma_mm))
    return [
        Mark(
            series=who,
            standoff_mm=true_mm,
            y=PERCENT * (range_mm / true_mm - 1),
            sd=PERCENT * sigma_mm / true_mm,
            expected_sd=None if reference is None else PERCENT * hypot(sigma_mm, reference) / true_mm,
        )
        for who, range_mm, sigma_mm in ranges
    ]
