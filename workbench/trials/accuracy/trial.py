"""Execution of the accuracy trial, with its table and chart."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.event import ReadingTaken
from workbench.model.reading_chart import error_chart
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.trials.accuracy.statistics import AccuracyRow, accuracy_row
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="missing", name="missing"),
    Column(key="mean_error_mm", name="mean error", unit="mm", format="+.2f"),
    Column(key="max_error_mm", name="max", unit="mm", format="+.2f"),
    Column(key="min_error_mm", name="min", unit="mm", format="+.2f"),
    Column(key="sd_mm", name="sd", unit="mm", format=".2f"),
    Column(key="range_sd_mm", name="stated u", unit="mm", format=".2f"),
    Column(key="reference_sd_mm", name="reference u", unit="mm", format=".2f"),
    Column(key="mean_relative_error", name="mean error", unit="%", scale=100, format="+.2f"),
)


def run_trial(context: Context, name: str, placements: Sequence[Placement], count: int) -> str:
    """Take `count` readings at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        WorkbenchError: see `visit_placements`.
    """
    ranger = session_ranger(context, name)

    def work(placement: Placement) -> list[ReadingTaken]:
        return take_readings(context, ranger, name, placement, count)

    taken = visit_placements(context, placements, work)
    rows = [accuracy_row(readings) for readings in taken]
    chart = error_chart(f"{name}-errors", [reading for readings in taken for reading in readings])
    finish_trial(context, name, [accuracy_table(name, rows)], [chart])
    return f"{sum(row.readings for row in rows)} readings, table in {name}.csv"


def accuracy_table(name: str, rows: Sequence[AccuracyRow]) -> Table:
    """Table of the error statistics, one row per standoff."""
    return Table(
        name=name,
        title="Accuracy: error = measured - true",
        columns=COLUMNS,
        rows=tuple(tuple(getattr(row, column.key) for column in COLUMNS) for row in rows),
        caption="a reading is the mean of the lasers; u: standard uncertainty",
    )
