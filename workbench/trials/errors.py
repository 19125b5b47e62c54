"""Statistics and tables of errors (measured - true) at one set-up: range, angle, radius."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import ReadingTaken
from workbench.model.table import Cell, Column, Table

EXPANSION = 2.0
"""Coverage factor k of an expanded uncertainty U whose standard uncertainty is known."""
EXPANSION_PROBABILITY = 0.9544997361036416
"""Coverage probability of k = 2 for a normal distribution."""


@dataclass(frozen=True)
class ErrorSpread:
    """Mean and spread of n errors, at least one, in their unit."""

    mean: float
    largest: float
    smallest: float
    sd: float | None
    """Standard deviation; None for a single error."""
    mean_absolute: float

    @classmethod
    def of(cls, errors: FloatArray) -> ErrorSpread:
        """Spread of (n,) errors."""
        return cls(
            float(errors.mean()),
            float(errors.max()),
            float(errors.min()),
            float(errors.std(ddof=1)) if len(errors) > 1 else None,
            float(np.abs(errors).mean()),
        )


@dataclass(frozen=True)
class ErrorStatistics:
    """Errors of the readings at one set-up, in the unit of the quantity."""

    n: int
    """Number of readings with a value; statistics are of these, and None if there are too few."""
    missing: int
    mean: float | None = None
    largest: float | None = None
    smallest: float | None = None
    sd: float | None = None
    """Standard deviation over the readings: what differs between them, without common errors."""
    mean_absolute: float | None = None
    expanded: float | None = None
    """Expanded uncertainty U (k = 2) of the mean error, by the sensor and the reference.

    Readings at one placement share calibration, speckle and placement: their number does not reduce it.
    """


def error_statistics(
    errors: Sequence[float | None], stated_sd: Sequence[float | None], reference_sd: float
) -> ErrorStatistics:
    """Statistics of n errors, in their unit.

    Args:
        errors: (n,) measured - true; None for a missing reading.
        stated_sd: (n,) standard uncertainty of each measured value; None for a missing reading.
        reference_sd: standard uncertainty of the true value.
    """
    found = np.array([error for error in errors if error is not None])
    missing = len(errors) - len(found)
    if not len(found):
        return ErrorStatistics(0, missing)
    stated = np.array([sd for sd in stated_sd if sd is not None])
    spread = ErrorSpread.of(found)
    return ErrorStatistics(
        len(found),
        missing,
        spread.mean,
        spread.largest,
        spread.smallest,
        spread.sd,
        spread.mean_absolute,
        EXPANSION * hypot(float(np.sqrt((stated**2).mean())), reference_sd),
    )


def error_columns(unit: str, digits: str) -> tuple[Column, ...]:
    """Columns of `error_cells`.

    Args:
        unit: unit of the quantity, suffix of the keys.
        digits: format of an error without its sign, for example `.2f`.
    """
    signed = f"+{digits}"
    return (
        Column(key="readings", name="n"),
        Column(key="missing", name="missing"),
        Column(key=f"mean_error_{unit}", name="mean error", unit=unit, format=signed),
        Column(key=f"max_error_{unit}", name="max", unit=unit, format=signed),
        Column(key=f"min_error_{unit}", name="min", unit=unit, format=signed),
        Column(key=f"sd_{unit}", name="sd", unit=unit, format=digits),
        Column(key=f"expanded_{unit}", name="U", unit=unit, format=digits),
        Column(key="mean_absolute_relative_error", name="mean abs", unit="%", scale=100, format=".2f"),
    )


def error_cells(statistics: ErrorStatistics, true: float) -> tuple[Cell, ...]:
    """Cells of one row, for the columns of `error_columns`."""
    absolute = statistics.mean_absolute
    return (
        statistics.n,
        statistics.missing,
        statistics.mean,
        statistics.largest,
        statistics.smallest,
        statistics.sd,
        statistics.expanded,
        None if absolute is None else absolute / abs(true),
    )


def range_statistics(readings: Sequence[ReadingTaken]) -> ErrorStatistics:
    """Statistics of the range errors of readings with one true range and reference uncertainty, mm."""
    return error_statistics(
        [reading.error_mm for reading in readings],
        [reading.sigma_mm for reading in readings],
        readings[0].reference_sd_mm or 0.0,
    )


def missing_table(
    name: str, readings: Iterable[ReadingTaken], quantity: str = "range", key: str = "range_mm"
) -> list[Table]:
    """Table of the readings without a value, with their causes; empty list if all have one.

    Args:
        name: name of the step, prefix of the table's name.
        readings: readings of the trial.
        quantity: name of the quantity.
        key: its field in a reading.
    """
    rows = tuple((r.reference_mm, r.scene, _cause(r)) for r in readings if getattr(r, key) is None)
    if not rows:
        return []
    columns = (
        Column(key="true_mm", name="true", unit="mm", format=".1f"),
        Column(key="scene", name="scene"),
        Column(key="cause", name="cause"),
    )
    title = f"Readings without {quantity}"
    return [Table(name=f"{name}-missing-{quantity}", title=title, columns=columns, rows=rows)]


def _cause(reading: ReadingTaken) -> str:
    """Cause of a missing range, or the shape and notes of a reading whose shape gives no such value."""
    return reading.cause or "; ".join((f"shape: {reading.shape}", *reading.notes))


@dataclass(frozen=True)
class ErrorPoint:
    """Error of one reading, in the unit of its chart."""

    true_mm: float
    error: float
    stated_sd: float | None
    reference_sd: float


def quantity_chart(name: str, title: str, y: Axis, points: Mapping[str, Sequence[ErrorPoint]]) -> Chart:
    """Chart of errors against the true range, one series for each name, bars: stated uncertainty."""
    return Chart(
        name=name,
        title=title,
        x=Axis(label="true range", unit="mm", scale="log"),
        y=y,
        series=tuple(_series(label, of) for label, of in points.items()),
    )


def _series(name: str, points: Sequence[ErrorPoint]) -> Series:
    return Series(
        name=name,
        x=tuple(point.true_mm for point in points),
        y=tuple(point.error for point in points),
        sd=tuple(point.stated_sd for point in points),
        expected_sd=tuple(
            None if point.stated_sd is None else hypot(point.stated_sd, point.reference_sd)
            for point in points
        ),
    )
