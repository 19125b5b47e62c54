"""Execution of the verification: the lasers against each other, then the ranges of a measured target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from workbench.model.errors import LimitFailedError
from workbench.model.event import ReadingTaken, TrialProgress
from workbench.model.reading_chart import error_chart
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.trials.limits import Result, check_results, require_readings
from workbench.trials.readings import take_readings
from workbench.trials.trial_run import TrialRun
from workbench.trials.verify.changes import changes, named
from workbench.trials.verify.compared import compared_sensor
from workbench.trials.verify.statistics import (
    PlacementCheck,
    Verdict,
    check_placement,
    lasers_verdict,
    predicted_mm,
    range_verdict,
)
from workbench.trials.verify.step import VerifyTrialStep
from workbench.trials.verify.tables import change_table, verify_tables


@dataclass(frozen=True)
class Checked:
    """Readings at one placement, and their check by the calibration."""

    readings: Sequence[ReadingTaken]
    check: PlacementCheck


def run_trial(context: Context, name: str, step: VerifyTrialStep) -> str:
    """Check the lasers against each other, then the ranges; returns the verdict in one line.

    Raises:
        BadInputError: there is no calibration, or the one to compare with is wrong.
        LimitFailedError: the calibration is not valid, a limit failed, or a standoff has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    sensor = run.ranger.sensor
    compared_sensor(context, name, step.compare_with)  # a wrong file is refused before any capture

    def work(placed: Placement) -> Checked:
        readings = take_readings(context, run.ranger, name, placed, step.readings)
        return Checked(readings, check_placement(sensor, readings, readings[0].reference_sd_mm or 0.0))

    unmeasured, *measured = step.placements(name, context.rig)
    visited = 1 + len(measured)
    for one in run.visit([unmeasured], work):
        verdict = lasers_verdict(one.check, visited)
        context.emit(TrialProgress(trial=name, text=f"{verdict.text}: {verdict.action}"))
        if not verdict.valid:
            return _finish(run, step, [], _explained(run, [one], verdict))
    checked = run.visit(measured, work)
    checks = [one.check for one in checked]
    verdicts = [*(lasers_verdict(check, visited) for check in checks), range_verdict(sensor, checks)]
    verdict = next((one for one in verdicts if not one.valid), verdicts[-1])
    return _finish(run, step, checked, verdict if verdict.valid else _explained(run, checked, verdict))


def verify_results(run: TrialRun, checks: Sequence[PlacementCheck]) -> list[Result]:
    """Mean errors at every standoff with their U, for limits."""
    found = []
    for check in checks:
        of, error_mm = f"{check.standoff_mm:g} mm", check.error_mm
        expanded_mm = None if error_mm is None else predicted_mm(run.ranger.sensor, check)
        relative = [None if one is None else one / check.standoff_mm for one in (error_mm, expanded_mm)]
        found += [
            Result.of_error("error_mm", of, error_mm, expanded_mm),
            Result.of_error("relative_error", of, relative[0], relative[1]),
        ]
    return found


def _explained(run: TrialRun, checked: Sequence[Checked], verdict: Verdict) -> Verdict:
    """Verdict with the change of the sensor that the errors of the lasers suggest."""
    found = changes(run.ranger.sensor, [one.check for one in checked], run.context.rig.bench)
    text = named(found)
    return replace(verdict, text=f"{verdict.text}; {text}", changes=tuple(found)) if text else verdict


def _finish(run: TrialRun, step: VerifyTrialStep, checked: Sequence[Checked], verdict: Verdict) -> str:
    """Write the results; raises LimitFailedError if the calibration is not valid."""
    name, checks = run.name, [one.check for one in checked]
    other = compared_sensor(run.context, name, step.compare_with)
    beside = None
    if other is not None:
        by_other = [check_placement(other, one.readings, one.check.reference_sd_mm) for one in checked]
        beside = (other, by_other)
    tables = verify_tables(name, run.ranger.sensor, checks, verdict, beside)
    if verdict.changes:
        tables.append(change_table(name, verdict.changes))
    own = [reading for one in checked for reading in one.readings]
    run.finish(tables, [error_chart(f"{name}-errors", own)] if own else [])
    text = f"{verdict.text}: {verdict.action}"
    if not verdict.valid:
        raise LimitFailedError(f"{name}: {text}")
    require_readings(name, [one.readings for one in checked])
    check_results(run.context, name, verify_results(run, checks), step.limits)
    return text
