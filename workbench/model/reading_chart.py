"""Chart of reading errors, shown live in the recording and among the results of a trial."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from workbench.model.chart import Axis, Chart, Series
from workbench.model.trial_event import ReadingTaken

SENSOR = "sensor"
"""Name of the series of the whole sensor, beside those of single lasers."""
PERCENT = 100.0


def error_chart(name: str, readings: Sequence[ReadingTaken]) -> Chart:
    """Chart of errors (measured - true) of readings and of their lasers, in percent of the true range.

    Lasers have no errors where the true range is not the standoff, which differs between the lasers there.

    The expected standard deviation of an error combines the stated uncertainty of the range and the reference
    uncertainty of the standoff. No error is an outlier if the latter is unknown.

    Args:
        name: name of the chart.
        readings: readings in the order in which they were taken.
    """
    points = [(reading, *one) for reading in readings for one in _errors(reading)]
    names = [*dict.fromkeys(name for _, name, _, _ in points if name != SENSOR), SENSOR]
    label = "standoff" if all(reading.true is None for reading in readings) else "true range"
    return Chart(
        name=name,
        title="Error of every reading, bars stated u",
        x=Axis(label=label, unit="mm", scale="log"),
        y=Axis(label="error", unit="%"),
        series=tuple(
            _series(name, [(r, mm, sd) for r, of, mm, sd in points if of == name]) for name in names
        ),
    )


def _errors(reading: ReadingTaken) -> list[tuple[str, float, float]]:
    """Name, error and stated standard uncertainty (mm) of every laser and of the sensor itself."""
    sigmas_mm = {one.laser_id: one.sigma_mm for one in reading.lasers}
    errors = [(name, error_mm, sigmas_mm[name]) for name, error_mm in reading.laser_errors_mm.items()]
    if reading.error_mm is not None and reading.sigma_mm is not None:
        errors.append((SENSOR, reading.error_mm, reading.sigma_mm))
    return errors


def _series(name: str, errors: Sequence[tuple[ReadingTaken, float, float]]) -> Series:
    percents = [PERCENT / reading.reference_mm for reading, _, _ in errors]
    expected_mm = [
        None if reading.reference_sd_mm is None else hypot(sd, reading.reference_sd_mm)
        for reading, _, sd in errors
    ]
    return Series(
        name=name,
        x=tuple(reading.reference_mm for reading, _, _ in errors),
        y=tuple(percent * mm for percent, (_, mm, _) in zip(percents, errors, strict=True)),
        sd=tuple(percent * sd for percent, (_, _, sd) in zip(percents, errors, strict=True)),
        expected_sd=tuple(
            None if sd is None else percent * sd for percent, sd in zip(percents, expected_mm, strict=True)
        ),
    )
