"""Execution of the repeatability trial: readings, their file, tables and charts."""

from __future__ import annotations

from workbench.model.event import ReadingTaken
from workbench.model.number_text import counted
from workbench.model.reading_chart import error_chart
from workbench.model.table import Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.trials.dither import dither
from workbench.trials.limits import Result, cell_number, require_readings
from workbench.trials.reading_frame import reading_frame, reading_rows
from workbench.trials.readings import take_reading
from workbench.trials.repeatability.budget import budget_table
from workbench.trials.repeatability.step import RepeatabilityTrialStep
from workbench.trials.repeatability.table import precision_chart, precision_table
from workbench.trials.results import write_readings
from workbench.trials.trial_run import TrialRun


def run_trial(context: Context, name: str, step: RepeatabilityTrialStep) -> str:
    """Take the repeats at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a standoff has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    placements = step.placements(name, context.rig)
    standoffs_mm = {placement.key: placement.standoff_mm for placement in placements}

    def work(placement: Placement) -> tuple[str, list[ReadingTaken]]:
        readings = []
        for number in range(step.repeats):
            dither(context, placement, number, step.dither_mm)
            readings.append(take_reading(context, run.ranger, name, placement, number))
        return placement.key, readings

    rows: list[dict[str, object]] = []
    taken: list[ReadingTaken] = []
    visited: dict[float, int] = {}
    by_standoff: dict[float, list[ReadingTaken]] = {}
    for key, readings in run.visit(placements, work):
        standoff_mm = standoffs_mm[key]
        visited[standoff_mm] = visited.get(standoff_mm, 0) + 1
        rows += reading_rows(readings, standoff_mm, visited[standoff_mm])
        taken += readings
        by_standoff.setdefault(standoff_mm, []).extend(readings)
    frame = reading_frame(rows)
    write_readings(context, name, frame)
    table = precision_table(f"{name}-table", frame)
    budget = budget_table(f"{name}-budget", frame)
    charts = [error_chart(f"{name}-errors", taken), precision_chart(f"{name}-precision", table)]
    run.finish([table, budget], charts)
    require_readings(name, by_standoff.values())
    run.check(precision_results(table), step.limits)
    return f"{counted(frame['measured_mm'].count(), 'reading')} in {name}.csv, statistics in {name}-table.csv"


def precision_results(table: Table) -> list[Result]:
    """Standard deviations at each standoff with their 95 % intervals, for limits.

    Args:
        table: result of `precision_table`.
    """
    return [
        Result(
            f"{key}_sd_mm",
            f"{row['standoff_mm']} mm",
            *(cell_number(row[f"{key}_{end}_mm"]) for end in ("sd", "low", "high")),
        )
        for row in table.records()
        for key in ("repeatability", "reproducibility")
    ]
