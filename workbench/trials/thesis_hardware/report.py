"""Tables and figures of the comparison with the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import ReadingTaken
from workbench.model.table import Cell, Column, Table
from workbench.trials.thesis_hardware.comparison import Row
from workbench.trials.thesis_hardware.quantities import (
    ANGLE,
    CLOSEST_RANGE,
    MEAN_RANGE,
    Quantity,
    Select,
    by_placement,
    is_incline,
    is_mean,
    is_round,
)

PERCENT = 100.0


def side_by_side(name: str, rows: Sequence[Row]) -> Table:
    """Table of every row: thesis, ours, ratio, goal. Relative errors are in percent."""
    return Table(
        name=name,
        title="Thesis's hardware tests (figures 33 to 42) and ours, the largest of all ranges",
        columns=(
            Column(key="figure", name="fig."),
            Column(key="target", name="target"),
            Column(key="quantity", name="quantity"),
            Column(key="to_mm", name="to", unit="mm"),
            Column(key="thesis", name="thesis", format=".3g"),
            Column(key="ours", name="ours", format=".3g"),
            Column(key="ratio", name="ratio", format=".2g"),
            Column(key="goal", name="goal", format=".3g"),
            Column(key="reached", name="met"),
        ),
        rows=tuple(_cells(row) for row in rows),
        caption="error: mean absolute value of the readings at a range; met: at every range; off: lasers"
        " left off",
    )


def readings_table(name: str, rows: Sequence[Row]) -> Table:
    """Table of the readings of every row, and of U where its value is largest."""
    columns = (
        Column(key="figure", name="fig."),
        Column(key="target", name="target"),
        Column(key="quantity", name="quantity"),
        Column(key="to_mm", name="to", unit="mm"),
        Column(key="readings", name="n"),
        Column(key="missing", name="missing"),
        Column(key="at_mm", name="at", unit="mm", format=".0f"),
        Column(key="expanded", name="U there", format=".2g"),
    )
    return Table(
        name=f"{name}-readings",
        title="Readings of each row",
        columns=columns,
        rows=tuple(
            (
                row.figure,
                row.target,
                _quantity(row),
                row.to_mm,
                row.readings,
                row.missing,
                row.at_mm,
                _shown(row, row.expanded) if row.unit == "%" else None,
            )
            for row in rows
        ),
        caption="n, missing: with and without the quantity; U: k = 2, of the error, in its unit",
    )


def goal_table(name: str, rows: Sequence[Row]) -> list[Table]:
    """Table of the goals that are not reached, with their reasons; empty list if all are reached."""
    failed = [row for row in rows if row.is_reached is False]
    if not failed:
        return []
    columns = (
        Column(key="figure", name="fig."),
        Column(key="target", name="target"),
        Column(key="quantity", name="quantity"),
        Column(key="ours", name="ours", format=".3g"),
        Column(key="goal", name="goal", format=".3g"),
        Column(key="at_mm", name="at", unit="mm", format=".0f"),
        Column(key="expanded", name="U there", format=".2g"),
        Column(key="reason", name="reason"),
    )
    cells = tuple(
        (
            row.figure,
            row.target,
            _quantity(row),
            _shown(row, row.ours),
            _shown(row, row.goal),
            row.at_mm,
            _shown(row, row.expanded),
            reason(row),
        )
        for row in failed
    )
    title = "Goals not reached"
    caption = "U: expanded uncertainty (k = 2) of the error, by sensor and reference"
    return [Table(name=f"{name}-goals", title=title, columns=columns, rows=cells, caption=caption)]


def reason(row: Row) -> str:
    """Reason why a goal is not reached, from the stated uncertainty there and the computed size of causes."""
    if row.ours is None:
        return "no reading has this quantity"
    lacking = f"no value at {', '.join(f'{mm:.0f}' for mm in row.lacking_mm)} mm" if row.lacking_mm else ""
    if row.goal is None or row.ours <= row.goal:
        return lacking
    return "; ".join(part for part in (lacking, _reason_of_error(row, row.ours, row.goal)) if part)


def _reason_of_error(row: Row, ours: float, goal: float) -> str:
    if row.expanded is None:
        return "no U of a ratio: fewer spots average noise and speckle less"
    is_within = ours <= row.expanded
    excess = ours - (goal if is_within else row.expanded)
    explains = row.cause_size is not None and row.cause_size >= excess
    if row.cause is not None and explains and (is_within or not row.cause.is_in_u):
        return f"{'within U: ' if is_within else ''}{row.cause.text}"
    if is_within:
        return "within U: noise and speckle of the spots, calibration, and reference"
    return "error exceeds U: the target is not as stated, or the sensor has changed"


def figures(name: str, readings: Sequence[ReadingTaken]) -> list[Chart]:
    """Figures 33 to 42 with our readings; those without readings are left out."""
    charts = [
        _error_figure(name, "33", "Flat: range error", MEAN_RANGE, is_mean, readings),
        _sd_figure(name, "34", "Flat: sd of the range", MEAN_RANGE, {"flat": is_mean}, readings),
        _error_figure(name, "35", "Incline of 30 deg: range error", CLOSEST_RANGE, is_incline(30), readings),
        _error_figure(name, "36", "Incline of 60 deg: range error", CLOSEST_RANGE, is_incline(60), readings),
        _error_figure(name, "37", "Incline of 30 deg: angle error", ANGLE, is_incline(30), readings),
        _error_figure(name, "38", "Incline of 60 deg: angle error", ANGLE, is_incline(60), readings),
        _sd_figure(name, "39", "Inclines: sd of the range", CLOSEST_RANGE, INCLINES, readings),
        _sd_figure(name, "40", "Inclines: sd of the angle", ANGLE, INCLINES, readings),
        _error_figure(name, "41", "Cylinder: range error", CLOSEST_RANGE, is_round, readings),
        _sd_figure(name, "42", "Cylinder: sd of the range", CLOSEST_RANGE, {"cylinder": is_round}, readings),
    ]
    return [chart for chart in charts if not chart.is_empty]


INCLINES: dict[str, Select] = {"30 deg": is_incline(30), "60 deg": is_incline(60)}


def _cells(row: Row) -> tuple[Cell, ...]:
    reached = row.is_reached
    return (
        row.figure,
        row.target,
        _quantity(row),
        row.to_mm,
        _shown(row, row.thesis),
        _shown(row, row.ours),
        row.ratio,
        _shown(row, row.goal),
        "" if reached is None else "yes" if reached else "NO",
    )


def _quantity(row: Row) -> str:
    return f"{row.quantity}, {row.unit}" if row.unit else row.quantity


def _shown(row: Row, value: float | None) -> float | None:
    return value if value is None or row.unit != "%" else PERCENT * value


def _error_figure(
    name: str, figure: str, title: str, quantity: Quantity, select: Select, readings: Sequence[ReadingTaken]
) -> Chart:
    """Mean, maximum and minimum of the absolute relative error against the true range."""
    points = []
    for group in by_placement(readings, select, inf):
        true = quantity.true(group[0])
        errors = [abs(error) for error in quantity.errors(group) if error is not None]
        if true and errors:
            relative = [PERCENT * error / abs(true) for error in errors]
            points.append(
                (group[0].reference_mm, sum(relative) / len(relative), max(relative), min(relative))
            )
    x = tuple(point[0] for point in points)
    lines = tuple(
        Series(name=of, x=x, y=tuple(point[index] for point in points), style="line", dashed=index > 1)
        for index, of in enumerate(("mean", "maximum", "minimum"), start=1)
    )
    return Chart(
        name=f"{name}-figure-{figure}",
        title=f"Fig. {figure}. {title}",
        x=Axis(label="range", unit="mm"),
        y=Axis(label="absolute error", unit="%"),
        series=lines,
    )


def _sd_figure(
    name: str,
    figure: str,
    title: str,
    quantity: Quantity,
    selected: dict[str, Select],
    readings: Sequence[ReadingTaken],
) -> Chart:
    """Standard deviation of the readings at each range against the true range."""
    lines = []
    for of, select in selected.items():
        groups = by_placement(readings, select, inf)
        x = tuple(group[0].reference_mm for group in groups)
        y = tuple(quantity.statistics(group).sd for group in groups)
        lines.append(Series(name=of, x=x, y=y, style="line"))
    return Chart(
        name=f"{name}-figure-{figure}",
        title=f"Fig. {figure}. {title}",
        x=Axis(label="range", unit="mm"),
        y=Axis(label="standard deviation", unit=quantity.unit),
        series=tuple(lines),
    )
