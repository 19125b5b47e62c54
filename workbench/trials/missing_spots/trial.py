"""Execution of the missing-spots trial, with its tables and chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from workbench.model.chart import Axis, Chart
from workbench.model.event import ReadingTaken
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.ranging.ranger import Ranger
from workbench.trials.errors import (
    ErrorPoint,
    error_cells,
    error_columns,
    missing_table,
    quantity_chart,
    range_statistics,
)
from workbench.trials.missing_spots.statistics import MissingSummary, missing_summary
from workbench.trials.readings import ClosestRange, session_ranger, take_reading
from workbench.trials.results import finish_trial
from workbench.trials.targets import TargetSpec

PERCENT = 100.0
ByNumber = dict[int, list[ReadingTaken]]
"""Readings at one placement by the number of lasers left off."""


def run_trial(
    context: Context,
    name: str,
    target: TargetSpec,
    placements: Sequence[Placement],
    numbers: Sequence[int],
    count: int,
) -> str:
    """Take `count` readings with each number of lasers left off at each placement.

    Args:
        context: session.
        name: name of the step.
        target: target of the trial.
        placements: its placements.
        numbers: numbers of lasers left off, 0 first.
        count: number of readings of each number.

    Returns:
        The outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        WorkbenchError: see `visit_placements`.
    """
    ranger = session_ranger(context, name)

    def work(placed: Placement) -> ByNumber:
        closest = ClosestRange.of(target, placed, ranger.sensor, context.rig)
        return {n: _readings(context, ranger, name, placed, closest, n, count) for n in numbers}

    taken = visit_placements(context, placements, work)
    readings = [reading for of in taken for n in numbers for reading in of[n]]
    full = [of[0] for of in taken]
    summaries = [missing_summary(n, [of[n] for of in taken], full) for n in numbers]
    tables = [error_table(name, taken), summary_table(name, summaries), *missing_table(name, readings)]
    finish_trial(context, name, tables, [missing_chart(name, taken)])
    return f"{len(readings)} readings, tables in {name}.csv and {name}-summary.csv"


def error_table(name: str, taken: Sequence[ByNumber]) -> Table:
    """Table of the errors of the range, one row per placement and number of lasers left off."""
    rows = [
        (readings[0].reference_mm, n, *error_cells(range_statistics(readings), readings[0].reference_mm))
        for of in taken
        for n, readings in of.items()
    ]
    return Table(
        name=name,
        title="Missing spots: error of the closest range",
        columns=(
            Column(key="true_mm", name="true", unit="mm", format=".1f"),
            Column(key="left_off", name="off"),
            *error_columns("mm", ".2f"),
        ),
        rows=tuple(rows),
        caption="off: number of lasers left off; U: expanded uncertainty (k = 2) of the error",
    )


def summary_table(name: str, summaries: Sequence[MissingSummary]) -> Table:
    """Table of the errors over all placements, relative to those of all lasers."""
    columns = (
        Column(key="left_off", name="off"),
        Column(key="readings", name="n"),
        Column(key="without_range", name="missing"),
        Column(
            key="mean_absolute_relative_error", name="mean abs error", unit="%", scale=PERCENT, format=".2f"
        ),
        Column(key="ratio", name="ratio to all", format=".2f"),
        Column(key="coverage", name="in interval", unit="%", scale=PERCENT, format=".0f"),
        Column(key="coverage_low", name="low", unit="%", scale=PERCENT, format=".0f"),
        Column(key="coverage_high", name="high", unit="%", scale=PERCENT, format=".0f"),
    )
    rows = tuple(tuple(getattr(one, column.key) for column in columns) for one in summaries)
    return Table(
        name=f"{name}-summary",
        title="Missing spots: compared with all lasers",
        columns=columns,
        rows=rows,
        caption="low, high: 95 % interval of the share in their interval (Clopper-Pearson, by placement)",
    )


def missing_chart(name: str, taken: Sequence[ByNumber]) -> Chart:
    """Chart of the relative error of every reading, one series for each number of lasers left off."""
    points: dict[str, list[ErrorPoint]] = {}
    for of in taken:
        for n, readings in of.items():
            series = points.setdefault(f"{n} off" if n else "all lasers", [])
            series += [_point(r, r.error_mm) for r in readings if r.error_mm is not None]
    y = Axis(label="error", unit="%")
    return quantity_chart(f"{name}-errors", "Error of every reading, bars stated u", y, points)


def _point(reading: ReadingTaken, error_mm: float) -> ErrorPoint:
    percent = PERCENT / reading.reference_mm
    stated = None if reading.sigma_mm is None else percent * reading.sigma_mm
    reference = percent * (reading.reference_sd_mm or 0.0)
    return ErrorPoint(reading.reference_mm, percent * error_mm, stated, reference)


def _readings(
    context: Context,
    ranger: Ranger,
    name: str,
    placed: Placement,
    closest: ClosestRange,
    left_off: int,
    count: int,
) -> list[ReadingTaken]:
    """Readings with `left_off` lasers off; every set of that size in turn."""
    sets = list(combinations(ranger.sensor.ids, left_off))
    return [
        take_reading(
            context, ranger, name, placed, number, replace(closest, left_off=sets[number % len(sets)])
        )
        for number in range(count)
    ]
