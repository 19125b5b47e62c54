"""Execution of the accuracy trial: readings, verdict, tables and chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workbench.model.event import ReadingTaken
from workbench.model.number_text import counted
from workbench.model.reading_chart import error_chart
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.accuracy.agreement import Agreement, Bench, PlacementErrors
from workbench.trials.accuracy.completeness import Completeness, lost_ranges
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.ranges import CLOSEST, MEAN, RangeError, range_errors
from workbench.trials.accuracy.statistics import accuracy_row
from workbench.trials.accuracy.tables import accuracy_table, detail_tables, verdict_table
from workbench.trials.accuracy.verdict import results_of, verdict_of
from workbench.trials.limits import require_readings
from workbench.trials.readings import take_full_reading
from workbench.trials.reference import Reference
from workbench.trials.trial_run import TrialRun


@dataclass(frozen=True)
class PlacementReadings:
    """Readings at one placement, and the errors of their ranges by name."""

    taken: Sequence[ReadingTaken]
    reference: Reference
    errors: Sequence[Mapping[str, RangeError]]
    expected: Sequence[str] = ()
    """Names of the ranges that the map of spots expects here."""


def run_trial(
    context: Context, name: str, placements: Sequence[Placement], count: int, limits: AccuracyLimits
) -> str:
    """Take `count` readings at each placement; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed, or a standoff has no range.
        WorkbenchError: see `TrialRun.visit`.
    """
    run = TrialRun(context, name)
    ranger = run.ranger

    def work(placement: Placement) -> PlacementReadings:
        reference = Reference.of(context.rig.bench, placement)
        both = [take_full_reading(context, ranger, name, placement, number) for number in range(count)]
        errors = [range_errors(ranger.sensor, reading, taken, reference) for taken, reading in both]
        expected = (CLOSEST, MEAN, *run.expected_ids(placement))
        return PlacementReadings([taken for taken, _ in both], reference, errors, expected)

    visited = run.visit(placements, work)
    rows = [accuracy_row(one.taken) for one in visited]
    chart = error_chart(f"{name}-errors", [reading for one in visited for reading in one.taken])
    ranges = agreements(ranger.sensor, context.rig.bench.ruler_scale.sd, visited)
    if not ranges:
        run.finish([accuracy_table(name, rows)], [chart])
        require_readings(name, [one.taken for one in visited])
    done = completeness(visited, run.skipped)
    verdict = verdict_of(ranges, limits, done)
    tables = [
        verdict_table(name, ranges, verdict, limits, done),
        accuracy_table(name, rows),
        *detail_tables(name, ranges),
    ]
    run.finish(tables, [chart])
    require_readings(name, [one.taken for one in visited])
    run.check(results_of(ranges, limits, done), limits)
    return f"{counted(sum(row.readings for row in rows), 'reading')}, table in {name}.csv; {verdict.text}"


def agreements(
    sensor: CalibratedSensor, scale_sd: float, visited: Sequence[PlacementReadings]
) -> list[Agreement]:
    """Agreement of the closest range, the mean range and each laser's range; without readings, none."""
    bench = Bench(sensor.covariance, scale_sd)
    found = []
    for name in (CLOSEST, MEAN, *sensor.ids):
        placements, missing = [], 0
        for one in visited:
            errors = [by_name[name] for by_name in one.errors if name in by_name]
            missing += len(one.errors) - len(errors)
            if errors:
                placements.append(PlacementErrors.of(one.reference, errors))
        if placements:
            found.append(Agreement(name, bench, tuple(placements), missing))
    return found


def completeness(visited: Sequence[PlacementReadings], skipped: Sequence[Placement]) -> Completeness:
    """Planned ranges that the trial did not measure."""
    lost = [
        found
        for one in visited
        for found in lost_ranges(one.reference.standoff_mm, one.expected, [list(of) for of in one.errors])
    ]
    return Completeness(len(visited), tuple(skipped), tuple(lost))
