"""The run of the accuracy trial, and its table and chart."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from workbench.model.chart import Axis, Chart, Series
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.ranging.ranger import Reading
from workbench.trials.accuracy.statistics import AccuracyRow, accuracy_row
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial

SENSOR = "sensor"
"""Series of the readings themselves, beside those of the single lasers."""
PERCENT = 100.0
COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm", meaning="Standoff by the ruler."),
    Column(key="readings", name="n", meaning="Readings with a range; the statistics are of these."),
    Column(key="missing", name="missing", meaning="Readings without a range."),
    Column(key="mean_error_mm", name="mean error", unit="mm", format="+.2f", meaning="Measured - true."),
    Column(key="max_error_mm", name="max", unit="mm", format="+.2f"),
    Column(key="min_error_mm", name="min", unit="mm", format="+.2f"),
    Column(key="sd_mm", name="sd", unit="mm", format=".2f", meaning="Over the readings at this placement."),
    Column(
        key="range_sd_mm",
        name="stated u",
        unit="mm",
        format=".2f",
        meaning="Stated standard uncertainty of one reading: calibration and spots.",
    ),
    Column(
        key="reference_sd_mm",
        name="reference u",
        unit="mm",
        format=".2f",
        meaning="Standard uncertainty of the true range: the placement, by the ruler.",
    ),
)


def run_trial(context: Context, name: str, placements: Sequence[Placement], count: int) -> str:
    """Take `count` readings at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        WorkbenchError: see `visit_placements`.
    """
    ranger = session_ranger(context, name)

    def work(placement: Placement) -> tuple[Placement, list[Reading]]:
        return placement, take_readings(context, ranger, name, placement, count)

    taken = visit_placements(context, placements, work)
    bench = context.rig.bench
    rows = [accuracy_row(placement.standoff_mm, readings, bench) for placement, readings in taken]
    chart = error_chart(name, taken, bench.placement_sd_mm)
    finish_trial(context, name, [accuracy_table(name, rows)], [chart])
    return f"{sum(row.readings for row in rows)} readings, table in {name}.csv"


def accuracy_table(name: str, rows: Sequence[AccuracyRow]) -> Table:
    """Statistics of the errors, a row a standoff."""
    return Table(
        name=name,
        title="Accuracy: error = measured - true",
        columns=COLUMNS,
        rows=tuple(tuple(getattr(row, column.key) for column in COLUMNS) for row in rows),
        caption="a reading is the mean of the lasers; u: standard uncertainty",
    )


def error_chart(
    name: str, taken: Sequence[tuple[Placement, Sequence[Reading]]], reference_sd_mm: float
) -> Chart:
    """Relative errors of every reading and of its lasers over the true range.

    An error is expected to be as large as the stated uncertainty and the reference's together.
    """
    points: dict[str, list[tuple[float, float, float, float]]] = {}
    for placement, readings in taken:
        true_mm = placement.standoff_mm
        for reading in readings:
            for who, range_mm, sigma_mm in _ranges(reading):
                percent = PERCENT / true_mm
                expected_mm = hypot(sigma_mm, reference_sd_mm)
                error, sd = percent * (range_mm - true_mm), percent * sigma_mm
                points.setdefault(who, []).append((true_mm, error, sd, percent * expected_mm))
    return Chart(
        name=f"{name}-errors",
        title="Error of every reading, bars stated u",
        x=Axis(label="true range", unit="mm", scale="log"),
        y=Axis(label="error", unit="%"),
        series=tuple(_series(who, points[who]) for who in sorted(points, key=lambda who: who == SENSOR)),
    )


def _ranges(reading: Reading) -> list[tuple[str, float, float]]:
    ranges = [(one.laser_id, one.range_mm, one.sigma_mm) for one in reading.lasers]
    if reading.flat_mm is not None and reading.flat_sigma_mm is not None:
        ranges.append((SENSOR, reading.flat_mm, reading.flat_sigma_mm))
    return ranges


def _series(name: str, points: Sequence[tuple[float, float, float, float]]) -> Series:
    x, y, sd, expected_sd = zip(*points, strict=True)
    return Series(name=name, x=x, y=y, sd=sd, expected_sd=expected_sd)
