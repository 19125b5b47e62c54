"""Execution of the missing-spots trial, with its tables and chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.model.chart import Axis, Chart
from workbench.model.event import ReadingTaken
from workbench.model.number_text import counted
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.ranging.ranger import Ranger
from workbench.trials.errors import (
    ErrorPoint,
    error_cells,
    error_columns,
    missing_table,
    quantity_chart,
    range_statistics,
)
from workbench.trials.limits import Result, range_results, require_readings
from workbench.trials.missing_spots.sets import ALL, Condition, block, missing_sets
from workbench.trials.missing_spots.statistics import MissingSummary, missing_summary
from workbench.trials.missing_spots.step import MissingSpotsTrialStep
from workbench.trials.readings import ClosestRange, take_reading
from workbench.trials.trial_run import TrialRun

PERCENT = 100.0
ByCondition = dict[Condition, list[ReadingTaken]]
"""Readings at one placement by the number and cause of missing spots."""


def run_trial(
    context: Context, name: str, step: MissingSpotsTrialStep, placements: Sequence[Placement]
) -> str:
    """Take the readings under each condition at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a placement has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    ranger = run.ranger

    def work(placed: Placement) -> ByCondition:
        closest = ClosestRange.of(step.target, placed, ranger.sensor, context.rig)
        found = {
            one: _readings(context, ranger, name, placed, closest, one, step.readings)
            for one in step.conditions
        }
        if step.blocked:
            block(context, placed, ())
        return found

    taken = run.visit(placements, work)
    by_placement = [[reading for readings in of.values() for reading in readings] for of in taken]
    readings = [reading for of in by_placement for reading in of]
    full = [of[ALL] for of in taken]
    summaries = [missing_summary(one, [of[one] for of in taken], full) for one in step.conditions if taken]
    tables = [error_table(name, taken), summary_table(name, summaries), *missing_table(name, readings)]
    run.finish(tables, [missing_chart(name, taken)])
    require_readings(name, by_placement)
    run.check(missing_results(taken, summaries), step.limits)
    return f"{counted(len(readings), 'reading')}, tables in {name}.csv and {name}-summary.csv"


def missing_results(taken: Sequence[ByCondition], summaries: Sequence[MissingSummary]) -> list[Result]:
    """Mean errors at each placement, and the summary of each condition, for limits."""
    errors = [
        result
        for of in taken
        for condition, readings in of.items()
        for result in range_results(f"{readings[0].reference_mm:.6g} mm, {condition.name}", readings)
    ]
    totals = [
        result
        for one in summaries
        for result in (
            *([Result("ratio", one.condition.name, one.ratio)] if one.condition.number else []),
            Result("coverage", one.condition.name, one.coverage, one.coverage_low, one.coverage_high),
            Result("lost", one.condition.name, one.lost),
        )
    ]
    return [*errors, *totals]


def error_table(name: str, taken: Sequence[ByCondition]) -> Table:
    """Table of the errors of the range, one row per placement and condition."""
    rows = [
        (
            readings[0].reference_mm,
            *_counts(condition),
            *error_cells(range_statistics(readings), readings[0].reference_mm),
        )
        for of in taken
        for condition, readings in of.items()
    ]
    return Table(
        name=name,
        title="Missing spots: error of the closest range",
        columns=(
            Column(key="true_mm", name="true", unit="mm", format=".1f"),
            Column(key="left_off", name="off"),
            Column(key="blocked", name="blocked"),
            *error_columns("mm", ".2f"),
        ),
        rows=tuple(rows),
        caption="off, blocked: number of lasers; U: expanded uncertainty (k = 2) of the error",
    )


def summary_table(name: str, summaries: Sequence[MissingSummary]) -> Table:
    """Table of the errors over all placements, relative to those of all lasers."""
    columns = (
        Column(key="readings", name="n"),
        Column(key="without_range", name="missing"),
        Column(
            key="mean_absolute_relative_error", name="mean abs error", unit="%", scale=PERCENT, format=".2f"
        ),
        Column(key="ratio", name="ratio to all", format=".2f"),
        Column(key="coverage", name="in interval", unit="%", scale=PERCENT, format=".0f"),
        Column(key="coverage_low", name="low", unit="%", scale=PERCENT, format=".0f"),
        Column(key="coverage_high", name="high", unit="%", scale=PERCENT, format=".0f"),
        Column(key="lost_high", name="lost, at most", unit="%", scale=PERCENT, format=".0f"),
    )
    rows = tuple(
        (*_counts(one.condition), *(getattr(one, column.key) for column in columns)) for one in summaries
    )
    return Table(
        name=f"{name}-summary",
        title="Missing spots: compared with all lasers",
        columns=(Column(key="left_off", name="off"), Column(key="blocked", name="blocked"), *columns),
        rows=rows,
        caption="low, high: 95 % interval of the share in their interval; lost, at most: one-sided 95 % bound"
        " of the share without a range (Clopper-Pearson, by placement; the interval by effective ones)",
    )


def missing_chart(name: str, taken: Sequence[ByCondition]) -> Chart:
    """Chart of the relative error of every reading, one series for each condition."""
    points: dict[str, list[ErrorPoint]] = {}
    for of in taken:
        for condition, readings in of.items():
            series = points.setdefault(condition.name, [])
            series += [_point(r, r.error_mm) for r in readings if r.error_mm is not None]
    y = Axis(label="error", unit="%")
    return quantity_chart(f"{name}-errors", "Error of every reading, bars stated u", y, points)


def _counts(condition: Condition) -> tuple[int, int]:
    """Numbers of lasers left off and blocked."""
    return (0, condition.number) if condition.cause == "blocked" else (condition.number, 0)


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
    condition: Condition,
    count: int,
) -> list[ReadingTaken]:
    """Readings under one condition, with every set of lasers in turn."""
    found: list[ReadingTaken] = []
    before: tuple[str, ...] = ()
    for number, ids in enumerate(missing_sets(ranger.sensor.ids, condition, count)):
        if condition.cause == "blocked" and ids != before:
            block(context, placed, ids)
            before = ids
        is_blocked = condition.cause == "blocked"
        missing = replace(closest, left_off=() if is_blocked else ids, blocked=ids if is_blocked else ())
        found.append(take_reading(context, ranger, name, placed, number, missing))
    return found
