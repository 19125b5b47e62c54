"""Execution of the gauge R&R trial: readings, their file, tables and charts."""

from __future__ import annotations

from math import inf

from workbench.model.event import ReadingTaken
from workbench.model.number_text import counted
from workbench.model.table import Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.trials.gauge_rr.step import GaugeTrialStep
from workbench.trials.gauge_rr.table import gauge_chart, gauge_table
from workbench.trials.limits import Result, cell_number, require_readings
from workbench.trials.reading_frame import reading_frame, reading_rows
from workbench.trials.readings import take_readings
from workbench.trials.results import write_readings
from workbench.trials.trial_run import TrialRun

MOST_CATEGORIES = 1e6
"""Number of categories that stands for the infinite one of a gauge without scatter."""


def run_trial(context: Context, name: str, step: GaugeTrialStep) -> str:
    """Take the readings of every operator's passes; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a standoff has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)

    def work(placement: Placement) -> tuple[str, list[ReadingTaken]]:
        return placement.key, take_readings(context, run.ranger, name, placement, step.readings)

    rows: list[dict[str, object]] = []
    by_standoff: dict[float, list[ReadingTaken]] = {}
    for each in step.rounds(name):
        context.ask(each.prompt)
        standoffs_mm = {placement.key: placement.standoff_mm for placement in each.placements}
        for key, readings in run.visit(each.placements, work):
            by_standoff.setdefault(standoffs_mm[key], []).extend(readings)
            rows += reading_rows(readings, standoffs_mm[key], each.trial, each.operator)
    frame = reading_frame(rows)
    write_readings(context, name, frame)
    table = gauge_table(f"{name}-table", frame)
    run.finish([table], [gauge_chart(f"{name}-errors", frame)])
    require_readings(name, by_standoff.values())
    run.check(gauge_results(table), step.limits)
    return f"{counted(frame['measured_mm'].count(), 'reading')} in {name}.csv, statistics in {name}-table.csv"


def gauge_results(table: Table) -> list[Result]:
    """GRR with its 95 % interval, its share of the total variation, and the categories, for limits.

    Args:
        table: result of `gauge_table`.
    """
    (row,) = [one for one in table.records() if one["component"] == "GRR"]
    found = {column.key: cell_number(row[column.key]) for column in table.columns}
    sd_mm, low_mm, high_mm = (found[key] for key in ("sd_mm", "low_mm", "high_mm"))
    if sd_mm is not None and low_mm is None:
        low_mm, high_mm = 0.0, inf  # without an interval no limit is decided
    categories = found["distinct_categories"]
    if sd_mm == 0 and found["study_variation"] == 0:
        categories = MOST_CATEGORIES
    return [
        Result("gauge_sd_mm", "GRR", sd_mm, low_mm, high_mm),
        Result("study_variation", "GRR", found["study_variation"]),
        Result("distinct_categories", "GRR", categories),
    ]
