"""Execution of the verification: the lasers against each other, then the ranges of a measured target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.model.errors import LimitFailedError
from workbench.model.event import ReadingTaken, TrialProgress
from workbench.model.reading_chart import error_chart
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.trials.limits import Result, require_readings
from workbench.trials.readings import take_readings
from workbench.trials.reference import standoff_sd_mm
from workbench.trials.trial_run import TrialRun
from workbench.trials.verify.changes import changes
from workbench.trials.verify.compared import compared_sensor
from workbench.trials.verify.laser_errors import laser_errors
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import PlacementCheck, check_placement, predicted_mm
from workbench.trials.verify.step import VerifyTrialStep
from workbench.trials.verify.tables import change_table, verify_tables
from workbench.trials.verify.verdict import Verdict, explained, lasers_verdict, ranges_verdict


@dataclass(frozen=True)
class Checked:
    """Readings at one placement, and their check by the calibration."""

    readings: Sequence[ReadingTaken]
    check: PlacementCheck


def run_trial(context: Context, name: str, step: VerifyTrialStep) -> str:
    """Check the lasers against each other, then the ranges; returns the verdict in one line.

    Raises:
        BadInputError: there is no calibration, it does not contain its bench, or the one to compare with is
            wrong.
        LimitFailedError: the calibration is not valid, a limit failed, or a standoff has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    sensor = run.ranger.sensor
    reference = _reference(run, step)
    compared_sensor(context, name, step.compare_with)  # a wrong file is refused before any capture

    def work(placed: Placement) -> Checked:
        readings = take_readings(context, run.ranger, name, placed, step.readings)
        return Checked(readings, check_placement(sensor, readings, standoff_sd_mm(placed, context.rig.bench)))

    unmeasured, *measured = step.placements(name, context.rig)
    first = run.visit([unmeasured], work)
    for one in first:
        verdict = lasers_verdict(one.check)
        context.emit(TrialProgress(trial=name, text=f"{verdict.text}: {verdict.action}"))
        if not verdict.valid:
            found = changes(sensor, laser_errors(reference, [one.check]))
            return _finish(run, step, [], explained(verdict, found))
    checked = run.visit(measured, work)
    verdict = ranges_verdict(sensor, reference, [one.check for one in checked], [one.check for one in first])
    return _finish(run, step, checked, verdict)


def verify_results(reference: Reference, checks: Sequence[PlacementCheck]) -> list[Result]:
    """Mean errors at every standoff with their U, for limits."""
    found = []
    for check in checks:
        of, error_mm = f"{check.standoff_mm:g} mm", check.error_mm(reference)
        expanded_mm = None if error_mm is None else predicted_mm(reference, check)
        relative = [None if one is None else one / check.standoff_mm for one in (error_mm, expanded_mm)]
        found += [
            Result.of_error("error_mm", of, error_mm, expanded_mm),
            Result.of_error("relative_error", of, relative[0], relative[1]),
        ]
    return found


def _reference(run: TrialRun, step: VerifyTrialStep) -> Reference:
    bench = run.context.rig.bench
    make = Reference.of_calibration if step.same_bench else Reference.own
    return make(run.ranger.sensor, bench)


def _finish(run: TrialRun, step: VerifyTrialStep, checked: Sequence[Checked], verdict: Verdict) -> str:
    """Write the results; raises LimitFailedError if the calibration is not valid."""
    name, checks = run.name, [one.check for one in checked]
    reference, other = _reference(run, step), compared_sensor(run.context, name, step.compare_with)
    beside = None
    if other is not None:
        by_other = [check_placement(other, one.readings, one.check.reference_sd_mm) for one in checked]
        beside = (Reference.own(other, run.context.rig.bench), by_other)
    tables = verify_tables(name, run.ranger.sensor, (reference, checks), verdict, beside)
    if verdict.changes:
        tables.append(change_table(name, verdict.changes))
    own = [reading for one in checked for reading in one.readings]
    run.finish(tables, [error_chart(f"{name}-errors", own)] if own else [])
    text = f"{verdict.text}: {verdict.action}"
    if not verdict.valid:
        raise LimitFailedError(f"{name}: {text}")
    require_readings(name, [one.readings for one in checked])
    run.check(verify_results(reference, checks), step.limits)
    return text
