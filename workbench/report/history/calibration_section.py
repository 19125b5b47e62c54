"""Section on the calibrations of a sensor: ranges and parameters over time, with their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.chart import Axis, Chart, Series
from workbench.model.table import Cell, Column, Table
from workbench.report.certificate.predecessor import verdict_text
from workbench.report.document import Section
from workbench.report.history.calibrations import RangeChange, compared, range_changes
from workbench.report.history.in_force import DatedCalibration

MOST_PARAMETERS = 6
"""Largest number of parameters in the chart: those that changed most."""


def calibration_section(calibrations: Sequence[DatedCalibration]) -> Section:
    """Ranges and parameters of every calibration against the first one."""
    key, title = "calibrations", "Calibrations"
    if not calibrations:
        return Section(key, title, texts=("No accepted calibration of this sensor is in the folder.",))
    changes = [range_changes(calibrations[0].calibration, one.calibration) for one in calibrations]
    ranges = sorted({change.range_mm for found in changes for change in found})
    rows: list[tuple[Cell, ...]] = []
    for n, one in enumerate(calibrations):
        found = None if n == 0 else compared(calibrations[n - 1].calibration, one.calibration)
        verdict = "first" if n == 0 else "not comparable" if found is None else verdict_text(found)
        by_range = {change.range_mm: change for change in changes[n]}
        cells = [by_range[mm].change_mm / mm if n and mm in by_range else None for mm in ranges]
        rows.append((one.session, one.day, *cells, verdict))
    table = Table(
        name="calibrations",
        title="Change of the ranges against the first calibration",
        columns=(
            Column(key="session", name="session"),
            Column(key="day", name="day"),
            *(
                Column(key=f"change.{mm:g}", name=f"at {mm:g} mm", unit="%", scale=100, format="+.3f")
                for mm in ranges
            ),
            Column(key="verdict", name="against the calibration before"),
        ),
        rows=tuple(rows),
    )
    charts = (_change_chart(calibrations, changes, ranges), _parameter_chart(calibrations))
    return Section(key, title, tables=(table,), charts=charts if len(calibrations) > 1 else ())


def _change_chart(
    calibrations: Sequence[DatedCalibration],
    changes: Sequence[Sequence[RangeChange]],
    ranges: Sequence[float],
) -> Chart:
    """Relative change at each distance over the number of the calibration."""
    by_range = [{change.range_mm: change for change in found} for found in changes]
    numbers = tuple(float(n) for n in range(1, len(calibrations) + 1))
    return Chart(
        name="range_changes",
        title="Change of ranges against the first calibration, bars 1 sigma of both",
        x=Axis(label="calibration"),
        y=Axis(label="change / range", unit="%"),
        series=tuple(
            Series(
                name=f"{mm:g} mm",
                x=numbers,
                y=tuple(100 * one[mm].change_mm / mm if mm in one else None for one in by_range),
                sd=tuple(100 * one[mm].sd_mm / mm if mm in one else None for one in by_range),
            )
            for mm in ranges
        ),
    )


def _parameter_chart(calibrations: Sequence[DatedCalibration]) -> Chart:
    """Parameters that changed most, in standard deviations of the first calibration."""
    values = [_parameters(one) for one in calibrations]
    first = values[0]
    common = [name for name, (_, sd) in first.items() if sd > 0 and all(name in one for one in values)]

    def changes(name: str) -> list[float]:
        return [(one[name][0] - first[name][0]) / first[name][1] for one in values]

    moved = sorted(common, key=lambda name: -max(map(abs, changes(name))))[:MOST_PARAMETERS]
    return Chart(
        name="parameter_changes",
        title="Parameters that changed most against the first calibration",
        x=Axis(label="calibration"),
        y=Axis(label="change / sd of the first"),
        series=tuple(
            Series(name=name, x=tuple(float(n) for n in range(1, len(values) + 1)), y=tuple(changes(name)))
            for name in moved
        ),
    )


def _parameters(one: DatedCalibration) -> dict[str, tuple[float, float]]:
    found = one.calibration.laser_ranger.parameters
    return dict(zip(found.names, zip(found.values, found.sd, strict=True), strict=True))
