"""Execution of the verification, with its tables."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.errors import LimitFailedError
from workbench.model.event import TrialProgress
from workbench.model.reading_chart import error_chart
from workbench.model.table import Cell, Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial
from workbench.trials.verify.statistics import (
    PlacementCheck,
    Verdict,
    check_placement,
    lasers_verdict,
    predicted_mm,
    range_verdict,
)

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="error_mm", name="observed error", unit="mm", format="+.2f"),
    Column(key="expanded_mm", name="predicted U", unit="mm", format=".2f"),
    Column(key="outside", name="outside"),
    Column(key="lasers_p", name="lasers agree, p", format=".2g"),
)


def run_trial(
    context: Context, name: str, unmeasured: Placement, measured: Sequence[Placement], count: int
) -> str:
    """Check the lasers against each other, then the ranges; returns the verdict in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: the calibration is not valid any more.
        WorkbenchError: see `visit_placements`.
    """
    ranger = session_ranger(context, name)

    def work(placed: Placement) -> PlacementCheck:
        readings = take_readings(context, ranger, name, placed, count)
        return check_placement(ranger.sensor, readings, readings[0].reference_sd_mm or 0.0)

    visited = 1 + len(measured)
    first = visit_placements(context, [unmeasured], work)
    for check in first:
        verdict = lasers_verdict(check, visited)
        context.emit(TrialProgress(trial=name, text=f"{verdict.text}: {verdict.action}"))
        if not verdict.valid:
            return _finish(context, name, ranger.sensor, [], verdict)
    checks = visit_placements(context, measured, work)
    verdicts = [
        *(lasers_verdict(check, visited) for check in checks),
        range_verdict(ranger.sensor, checks),
    ]
    verdict = next((one for one in verdicts if not one.valid), verdicts[-1])
    return _finish(context, name, ranger.sensor, checks, verdict)


def verify_tables(
    name: str, sensor: CalibratedSensor, checks: Sequence[PlacementCheck], verdict: Verdict
) -> list[Table]:
    """Table of predicted and observed errors, and the verdict with its action."""
    return [
        Table(
            name=name,
            title="Verification: error = measured - true",
            columns=COLUMNS,
            rows=tuple(_row(sensor, check) for check in checks),
            caption="predicted U: expanded uncertainty (k = 2) by calibration, spots and reference",
        ),
        Table(
            name=f"{name}-verdict",
            title="Verdict",
            columns=(
                Column(key="valid", name="valid"),
                Column(key="verdict", name="verdict"),
                Column(key="action", name="action"),
            ),
            rows=(("yes" if verdict.valid else "NO", verdict.text, verdict.action),),
        ),
    ]


def _row(sensor: CalibratedSensor, check: PlacementCheck) -> tuple[Cell, ...]:
    error_mm = check.error_mm
    if error_mm is None:
        return (check.standoff_mm, 0, None, None, None, None)
    expanded_mm = predicted_mm(sensor, check)
    outside = abs(error_mm) > expanded_mm
    return (check.standoff_mm, check.readings, error_mm, expanded_mm, outside, check.lasers_p)


def _finish(
    context: Context,
    name: str,
    sensor: CalibratedSensor,
    checks: Sequence[PlacementCheck],
    verdict: Verdict,
) -> str:
    """Write the results; raises LimitFailedError if the calibration is not valid."""
    own = [r for r in context.readings if r.trial == name and "/unmeasured-" not in r.scene]
    charts = [error_chart(f"{name}-errors", own)] if own else []
    finish_trial(context, name, verify_tables(name, sensor, checks, verdict), charts)
    text = f"{verdict.text}: {verdict.action}"
    if not verdict.valid:
        raise LimitFailedError(f"{name}: {text}")
    return text
