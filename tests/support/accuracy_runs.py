"""Runs of the accuracy trial on simulated benches."""

from __future__ import annotations

from collections.abc import Sequence

from tests.support.simulated_trials import SimulatedBench
from workbench.procedure.engine.step import flat_placement
from workbench.trials.accuracy.agreement import Agreement
from workbench.trials.accuracy.completeness import Completeness
from workbench.trials.accuracy.ranges import CLOSEST, MEAN, range_errors
from workbench.trials.accuracy.trial import PlacementReadings, agreements, completeness
from workbench.trials.reference import Reference

STANDOFFS_MM = (140.0, 250.0, 500.0, 1100.0, 2000.0, 3800.0)


COMPLETE = Completeness(len(STANDOFFS_MM))


def accuracy_run(
    bench: SimulatedBench, standoffs_mm: Sequence[float] = STANDOFFS_MM, count: int = 5
) -> list[Agreement]:
    """Agreement of every range in one run."""
    return incomplete_run(bench, standoffs_mm, count)[0]


def incomplete_run(
    bench: SimulatedBench,
    standoffs_mm: Sequence[float] = STANDOFFS_MM,
    count: int = 5,
    dead: Sequence[str] = (),
) -> tuple[list[Agreement], Completeness]:
    """Agreement of every range in one run, and what was not measured; lasers in `dead` have no spot."""
    visited, ids = [], (CLOSEST, MEAN, *bench.ranger.sensor.ids)
    for standoff_mm in standoffs_mm:
        placement = flat_placement("a", standoff_mm)
        reference = Reference.of(bench.rig.bench, placement)
        both = bench.readings("a", placement, count, without=dead)
        errors = [range_errors(bench.ranger.sensor, reading, taken, reference) for taken, reading in both]
        visited.append(PlacementReadings([taken for taken, _ in both], reference, errors, ids))
    found = agreements(bench.ranger.sensor, bench.rig.bench.ruler_scale.sd, visited)
    return found, completeness(visited, ())
