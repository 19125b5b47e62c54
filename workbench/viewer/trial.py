"""A trial: the error of every reading with its stated standard deviation, and the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot

import rerun as rr

from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import ReadingTaken, TrialFinished
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.chart import log_chart
from workbench.viewer.stream import Stream

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
        """Log the table, and the chart of all readings with its outliers."""
        self._log_chart({row.standoff_mm: row.reference_sd_mm for row in trial.rows})
        self._document(documents.trial_table(trial, self.readings))

    def stop(self) -> None:
        """The session ends: show what there is."""
        if self.readings:
            self._log_chart()

    def _log_chart(self, reference_sd_mm: Mapping[float, float] | None = None) -> None:
        colors = {**self.colors, at.SENSOR: at.WHITE}
        chart = error_chart(self.readings, reference_sd_mm or {})
        log_chart(self.stream, at.TRIAL_CHART, chart, colors, "no trial yet")

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


def error_chart(readings: Sequence[ReadingTaken], reference_sd_mm: Mapping[float, float]) -> Chart:
    """Relative errors of all readings and of their lasers, in percent of the true range.

    `reference_sd_mm` is the reference uncertainty of each standoff. That is part of the error but not of what
    the sensor states, so only where it is known can an error be an outlier.
    """
    names = [*dict.fromkeys(one.laser_id for reading in readings for one in reading.lasers), at.SENSOR]
    points = [(reading, *one) for reading in readings for one in _ranges(reading)]
    return Chart(
        name="trial_errors",
        title="Error of every reading, bars stated 1 sigma",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label="error", unit="%"),
        series=tuple(
            _series(name, [(r, mm, sd) for r, who, mm, sd in points if who == name], reference_sd_mm)
            for name in names
        ),
    )


def _ranges(reading: ReadingTaken) -> list[tuple[str, float, float]]:
    """Name, range and stated sd (mm) of every laser and of the sensor itself."""
    ranges = [(one.laser_id, one.range_mm, one.sigma_mm) for one in reading.lasers]
    if reading.range_mm is not None and reading.sigma_mm is not None:
        ranges.append((at.SENSOR, reading.range_mm, reading.sigma_mm))
    return ranges


def _series(
    name: str, ranges: Sequence[tuple[ReadingTaken, float, float]], reference_sd_mm: Mapping[float, float]
) -> Series:
    true_mm = [reading.standoff_mm for reading, _, _ in ranges]
    reference = [reference_sd_mm.get(true) for true in true_mm]
    sd_mm = [sd for _, _, sd in ranges]
    return Series(
        name=name,
        x=tuple(true_mm),
        y=tuple(PERCENT * (mm / true - 1) for true, (_, mm, _) in zip(true_mm, ranges, strict=True)),
        sd=tuple(PERCENT * sd / true for true, sd in zip(true_mm, sd_mm, strict=True)),
        expected_sd=tuple(
            None if other is None else PERCENT * hypot(sd, other) / true
            for true, sd, other in zip(true_mm, sd_mm, reference, strict=True)
        ),
    )
