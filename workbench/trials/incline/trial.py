"""Execution of the incline trial, with its tables and charts."""

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
    error_cells,
    error_columns,
    missing_table,
    quantity_chart,
)
from workbench.trials.incline.common_tilt import CommonTilt, InclinePoints, common_tilts
from workbench.trials.incline.statistics import (
    AngleDifference,
    AngleLine,
    InclineRow,
    angle_differences,
    angle_lines,
    incline_row,
)
from workbench.trials.incline.step import InclineTrialStep
from workbench.trials.limits import Result, error_result, range_results, require_readings
from workbench.trials.readings import ClosestRange, take_readings
from workbench.trials.target_check import Points
from workbench.trials.trial_run import TrialRun

SET_UP = (
    Column(key="axis", name="axis"),
    Column(key="angle_deg", name="set", unit="deg"),
    Column(key="true_mm", name="true", unit="mm", format=".1f"),
)
U_CAPTION = "U: expanded uncertainty (k = 2) of the error, by sensor and reference"


def run_trial(context: Context, name: str, step: InclineTrialStep) -> str:
    """Take the readings at each set-up; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a set-up has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    ranger, set_ups = run.ranger, step.set_ups(name, context.rig)
    by_key = {set_up.placement.key: set_up for set_up in set_ups}

    def work(placed: Placement) -> tuple[InclineRow, list[ReadingTaken]]:
        set_up = by_key[placed.key]
        closest = ClosestRange.of(set_up.target, placed, ranger.sensor, context.rig)
        readings = take_readings(context, ranger, name, placed, step.readings, closest)
        return incline_row(set_up.target, set_up.range_mm, readings), readings

    taken = run.visit([set_up.placement for set_up in set_ups], work)
    rows = [row for row, _ in taken]
    readings = [reading for _, of in taken for reading in of]
    tables = [
        *incline_tables(name, rows, angle_differences(rows)),
        *line_table(name, angle_lines(rows)),
        *(tilt_table(name, _common_tilts(run, taken)) if step.same_bench else []),
        *missing_table(name, readings),
        *missing_table(name, readings, "angle", "angle_deg"),
    ]
    charts = [error_chart(f"{name}-errors", readings), angle_chart(name, taken)]
    run.finish(tables, charts)
    require_readings(name, [of for _, of in taken])
    run.check([one for row, of in taken for one in incline_results(row, of)], step.limits)
    angles = sum(row.angle.n for row in rows)
    count = f"{counted(len(readings), 'reading')}, {angles} with an angle"
    return f"{count}, tables in {name}.csv and {name}-angle.csv"


def _common_tilts(
    run: TrialRun, taken: Sequence[tuple[InclineRow, Sequence[ReadingTaken]]]
) -> list[CommonTilt]:
    sensor = run.ranger.sensor
    found = [(row.target, Points.of(sensor, readings)) for row, readings in taken]
    set_ups = [InclinePoints(target, points) for target, points in found if points is not None]
    return common_tilts(sensor, set_ups, run.context.rig.bench) if set_ups else []


def tilt_table(name: str, tilts: Sequence[CommonTilt]) -> list[Table]:
    """Table of the tilt of the target's mount; empty list without any."""
    if not tilts:
        return []
    columns = (
        Column(key="axis", name="axis"),
        Column(key="tilt_deg", name="tilt", unit="deg", format="digits of sd_deg"),
        Column(key="sd_deg", name="sd", unit="deg", format="sd"),
        Column(key="known_sd_deg", name="sd by calibration", unit="deg", format="sd"),
        Column(key="rig_keys", name="bench in the rig file"),
    )
    return [
        Table(
            name=f"{name}-tilt",
            title="Incline: tilt common to all placements on the mount of the calibration",
            columns=columns,
            rows=tuple(tuple(getattr(one, column.key) for column in columns) for one in tilts),
            caption="for the next calibration, by new captures; of two axes the larger sd counts",
        )
    ]


def incline_results(row: InclineRow, readings: Sequence[ReadingTaken]) -> list[Result]:
    """Mean errors at one set-up, for limits."""
    of = f"{row.target.angle_deg:g} deg {row.target.axis} at {row.true_mm:.6g} mm"
    return [*range_results(of, readings), error_result("angle_error_deg", of, row.angle)]


def incline_tables(
    name: str, rows: Sequence[InclineRow], differences: Sequence[AngleDifference]
) -> list[Table]:
    """Tables of the errors of range and angle, and of the differences of set angles if there are any."""
    tables = [
        _table(name, "Incline: error of the closest range", "mm", [_range_row(row) for row in rows]),
        _table(f"{name}-angle", "Incline: error of the angle", "deg", [_angle_row(row) for row in rows]),
    ]
    if differences:
        tables.append(difference_table(name, differences))
    return tables


def difference_table(name: str, differences: Sequence[AngleDifference]) -> Table:
    """Table of the differences of set angles."""
    return Table(
        name=f"{name}-difference",
        title="Incline: difference of two angles, measured - set",
        columns=(
            Column(key="asked_mm", name="range", unit="mm", format=".1f"),
            Column(key="first_deg", name="first", unit="deg"),
            Column(key="second_deg", name="second", unit="deg"),
            Column(key="error_deg", name="error", unit="deg", format="+.2f"),
            Column(key="expanded_deg", name="U", unit="deg", format=".2f"),
        ),
        rows=tuple((d.asked_mm, *d.angles_deg, d.error_deg, d.expanded_deg) for d in differences),
        caption="a tilt common to both angles cancels; U (k = 2): errors of both taken as independent",
    )


def line_table(name: str, lines: Sequence[AngleLine]) -> list[Table]:
    """Table of the lines through the angles; empty list without any."""
    if not lines:
        return []
    columns = (
        Column(key="axis", name="axis"),
        Column(key="asked_mm", name="range", unit="mm", format=".1f"),
        Column(key="angles", name="angles"),
        Column(key="slope", name="slope", format="digits of slope_sd"),
        Column(key="slope_sd", name="sd", format="sd"),
        Column(key="intercept_deg", name="intercept", unit="deg", format="digits of intercept_sd_deg"),
        Column(key="intercept_sd_deg", name="sd", unit="deg", format="sd"),
        Column(key="probability", name="p", format=".2g"),
    )
    return [
        Table(
            name=f"{name}-line",
            title="Incline: line through the measured angles over the set ones",
            columns=columns,
            rows=tuple(tuple(getattr(one, column.key) for column in columns) for one in lines),
            caption="errors in both angles; intercept: common tilt; p: deviations from the line",
        )
    ]


def angle_chart(name: str, taken: Sequence[tuple[InclineRow, Sequence[ReadingTaken]]]) -> Chart:
    """Chart of the angle error of every reading, one series for each set angle."""
    points: dict[str, list[ErrorPoint]] = {}
    for row, readings in taken:
        of = points.setdefault(f"{row.target.angle_deg:g} deg {row.target.axis}", [])
        of += [
            ErrorPoint(row.true_mm, r.angle_deg - row.true_deg, r.angle_sd_deg, row.reference_sd_deg)
            for r in readings
            if r.angle_deg is not None
        ]
    y = Axis(label="angle error", unit="deg")
    return quantity_chart(f"{name}-angles", "Error of every angle, bars stated u", y, points)


def _table(name: str, title: str, unit: str, rows: Sequence[tuple[Cell, ...]]) -> Table:
    columns = (*SET_UP, *error_columns(unit, ".2f"))
    return Table(name=name, title=title, columns=columns, rows=tuple(rows), caption=U_CAPTION)


def _range_row(row: InclineRow) -> tuple[Cell, ...]:
    return (row.target.axis, row.target.angle_deg, row.true_mm, *error_cells(row.range, row.true_mm))


def _angle_row(row: InclineRow) -> tuple[Cell, ...]:
    return (row.target.axis, row.target.angle_deg, row.true_mm, *error_cells(row.angle, row.true_deg))
