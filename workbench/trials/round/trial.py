"""Execution of the round trial, with its tables and charts."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.chart import Axis, Chart
from workbench.model.event import ReadingTaken
from workbench.model.number_text import counted
from workbench.model.reading_chart import error_chart
from workbench.model.table import Cell, Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.trials.errors import (
    ErrorPoint,
    ErrorStatistics,
    error_cells,
    error_columns,
    error_statistics,
    missing_table,
    quantity_chart,
    range_statistics,
)
from workbench.trials.limits import Result, error_result, range_results, require_readings
from workbench.trials.readings import ClosestRange, take_readings
from workbench.trials.round.step import RoundTrialStep
from workbench.trials.targets import CylinderSpec
from workbench.trials.trial_run import TrialRun

CAPTION = "U: expanded uncertainty (k = 2) of the error, by sensor and reference"


def run_trial(context: Context, name: str, step: RoundTrialStep, placements: Sequence[Placement]) -> str:
    """Take the readings at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a placement has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    ranger, target = run.ranger, step.target

    def work(placed: Placement) -> list[ReadingTaken]:
        closest = ClosestRange.of(target, placed, ranger.sensor, context.rig)
        return take_readings(context, ranger, name, placed, step.readings, closest)

    taken = run.visit(placements, work)
    readings = [reading for of in taken for reading in of]
    tables = [
        *round_tables(name, target, taken),
        *missing_table(name, readings),
        *missing_table(name, readings, "radius", "radius_mm"),
    ]
    charts = [error_chart(f"{name}-errors", readings), radius_chart(name, target, readings)]
    run.finish(tables, charts)
    require_readings(name, taken)
    run.check([one for of in taken for one in round_results(target, of)], step.limits)
    radii = sum(reading.radius_mm is not None for reading in readings)
    count = f"{counted(len(readings), 'reading')}, {radii} with a radius"
    return f"{count}, tables in {name}.csv and {name}-radius.csv"


def cylinder_statistics(readings: Sequence[ReadingTaken]) -> ErrorStatistics:
    """Statistics of the errors of the closest range by the cylinder at one placement, mm."""
    return error_statistics(
        [None if r.cylinder_mm is None else r.cylinder_mm - r.reference_mm for r in readings],
        [r.cylinder_sd_mm for r in readings],
        readings[0].reference_sd_mm or 0.0,
    )


def radius_statistics(target: CylinderSpec, readings: Sequence[ReadingTaken]) -> ErrorStatistics:
    """Statistics of the radius errors at one placement, mm."""
    true_mm = target.diameter_mm / 2
    return error_statistics(
        [None if reading.radius_mm is None else reading.radius_mm - true_mm for reading in readings],
        [reading.radius_sd_mm for reading in readings],
        target.diameter_sd_mm / 2,
    )


def round_tables(name: str, target: CylinderSpec, taken: Sequence[Sequence[ReadingTaken]]) -> list[Table]:
    """Tables of the errors of the range as printed, the range by the cylinder, and the radius."""
    columns = (Column(key="true_mm", name="true", unit="mm", format=".1f"), *error_columns("mm", ".2f"))
    true_mm = [readings[0].reference_mm for readings in taken]
    ranges = [error_cells(range_statistics(of), mm) for mm, of in zip(true_mm, taken, strict=True)]
    by_cylinder = [error_cells(cylinder_statistics(of), mm) for mm, of in zip(true_mm, taken, strict=True)]
    radii = [error_cells(radius_statistics(target, of), target.diameter_mm / 2) for of in taken]
    return [
        Table(name=table, title=title, columns=columns, rows=_rows(true_mm, cells), caption=CAPTION)
        for table, title, cells in (
            (name, "Cylinder: error of the closest range as `workbench range` prints it", ranges),
            (f"{name}-cylinder", "Cylinder: error of the closest range by the fitted cylinder", by_cylinder),
            (
                f"{name}-radius",
                f"Cylinder: error of the radius, true {target.diameter_mm / 2:g} mm",
                radii,
            ),
        )
    ]


def round_results(target: CylinderSpec, readings: Sequence[ReadingTaken]) -> list[Result]:
    """Mean errors at one placement, for limits."""
    of = f"{readings[0].reference_mm:.6g} mm"
    return [
        *range_results(of, readings),
        error_result("cylinder_error_mm", of, cylinder_statistics(readings)),
        error_result("radius_error_mm", of, radius_statistics(target, readings)),
    ]


def radius_chart(name: str, target: CylinderSpec, readings: Sequence[ReadingTaken]) -> Chart:
    """Chart of the radius error of every reading."""
    true_mm = target.diameter_mm / 2
    points = [
        ErrorPoint(r.reference_mm, r.radius_mm - true_mm, r.radius_sd_mm, target.diameter_sd_mm / 2)
        for r in readings
        if r.radius_mm is not None
    ]
    y = Axis(label="radius error", unit="mm")
    return quantity_chart(f"{name}-radii", "Error of every radius, bars stated u", y, {"radius": points})


def _rows(true_mm: Sequence[float], cells: Sequence[tuple[Cell, ...]]) -> tuple[tuple[Cell, ...], ...]:
    return tuple((mm, *row) for mm, row in zip(true_mm, cells, strict=True))
