"""Execution of the gauge R&R trial: readings, their file, tables and charts."""

from __future__ import annotations

from workbench.model.event import ReadingTaken
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.trials.gauge_rr.step import GaugeTrialStep
from workbench.trials.gauge_rr.table import gauge_chart, gauge_table
from workbench.trials.reading_frame import reading_frame, reading_rows
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial, write_readings


def run_trial(context: Context, name: str, step: GaugeTrialStep) -> str:
    """Take the readings of every operator's passes; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        WorkbenchError: see `visit_placements`.
    """
    ranger = session_ranger(context, name)

    def work(placement: Placement) -> tuple[str, list[ReadingTaken]]:
        return placement.key, take_readings(context, ranger, name, placement, step.readings)

    rows: list[dict[str, object]] = []
    for each in step.rounds(name):
        context.ask(each.prompt)
        standoffs_mm = {placement.key: placement.standoff_mm for placement in each.placements}
        for key, readings in visit_placements(context, each.placements, work):
            rows += reading_rows(readings, standoffs_mm[key], each.trial, each.operator)
    frame = reading_frame(rows)
    write_readings(context, name, frame)
    finish_trial(context, name, [gauge_table(f"{name}-table", frame)], [gauge_chart(f"{name}-errors", frame)])
    return f"{frame['measured_mm'].count()} readings in {name}.csv, statistics in {name}-table.csv"
