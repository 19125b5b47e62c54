"""Verdict of the accuracy trial."""

from __future__ import annotations

import pytest

from tests.support.accuracy_runs import COMPLETE, STANDOFFS_MM, accuracy_run, incomplete_run
from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.model.target import Placement
from workbench.trials.accuracy.completeness import Completeness, LostRange
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.ranges import MEAN
from workbench.trials.accuracy.verdict import error_results, range_decision, results_of, verdict_of

RANGES = accuracy_run(SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1))


@pytest.mark.parametrize(("bound", "decision"), [(None, None), (0.5, "pass"), (0.003, "neither")])
def test_the_decision_is_that_of_the_limits(bound: float | None, decision: str | None) -> None:
    stated = {} if bound is None else {"mean_relative_error": {"in": [-bound, bound]}}
    assert verdict_of(RANGES, AccuracyLimits.model_validate(stated), COMPLETE).decision == decision


def test_a_sensor_that_has_changed_is_biased() -> None:
    changed = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1, {"f_px": 0.02 * 533.3})
    limits = AccuracyLimits.model_validate(
        {"mean_relative_error": {"in": [-0.005, 0.005]}, "bias_p": {"in": [0.05, None]}}
    )
    verdict = verdict_of(accuracy_run(changed), limits, COMPLETE)
    assert verdict.is_biased
    assert verdict.decision == "fail"
    assert not verdict_of(RANGES, limits, COMPLETE).is_biased


@pytest.mark.parametrize(("placement_sd_mm", "exact"), [(0.0, True), (0.3, False)])
def test_standoffs_without_an_uncertainty_are_named(placement_sd_mm: float, exact: bool) -> None:
    rig = thesis_rig()
    stated = rig.bench.model_copy(update={"placement_sd_mm": placement_sd_mm})
    bench = SimulatedBench.draw(thesis_ranger(), rig.model_copy(update={"bench": stated}), 1)
    verdict = verdict_of(accuracy_run(bench), AccuracyLimits.model_validate({}), COMPLETE)
    assert verdict.has_exact_standoffs is exact
    assert ("placement_sd_mm" in verdict.text) is exact


def test_each_placement_is_a_result_in_mm_and_relative() -> None:
    (mean,) = [one for one in RANGES if one.name == MEAN]
    found = error_results(mean)
    assert [one.quantity for one in found] == ["mean_error_mm", "mean_relative_error"] * len(mean.placements)
    first, relative = found[:2]
    assert first.value == pytest.approx(mean.errors_mm[0])
    assert relative.value == pytest.approx(mean.errors_mm[0] / mean.true_mm[0])
    assert first.high is not None
    assert first.low is not None
    assert (first.high - first.low) / 2 == pytest.approx(mean.uncertainty[0].expanded)


def test_results_of_lasers_share_one_limit() -> None:
    limits = AccuracyLimits.model_validate({"laser_error_mm": {"in": [-1, 1]}})
    lasers = [one for one in results_of(RANGES, limits, COMPLETE) if one.quantity == "laser_error_mm"]
    assert len({one.of.split()[0] for one in lasers}) == 4


def test_a_laser_without_any_spot_fails_the_limit_on_lasers() -> None:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1)
    ranges, done = incomplete_run(bench, dead=["L3"])
    limits = AccuracyLimits.model_validate({"laser_relative_error": {"in": [-0.5, 0.5]}})
    assert {one.name for one in done.lost} == {"L3"}
    assert len(done.lost) == len(STANDOFFS_MM)
    assert verdict_of(ranges, limits, done).decision == "fail"
    assert "L3" in verdict_of(ranges, limits, done).text
    assert [range_decision("L3", None, limits, done), range_decision(MEAN, ranges[1], limits, done)] == [
        "fail",
        None,
    ]
    lost = [one for one in results_of(ranges, limits, done) if one.value is None]
    assert {one.quantity for one in lost} == {"laser_error_mm", "laser_relative_error"}
    assert len(lost) == 2 * len(STANDOFFS_MM)


def test_a_range_that_is_lost_at_one_standoff_fails() -> None:
    done = Completeness(len(STANDOFFS_MM), lost=(LostRange("L2", 500.0, 5),))
    limits = AccuracyLimits.model_validate({"laser_relative_error": {"in": [-0.5, 0.5]}})
    (second,) = [one for one in RANGES if one.name == "L2"]
    assert verdict_of(RANGES, limits, COMPLETE).decision == "pass"
    assert verdict_of(RANGES, limits, done).decision == "fail"
    assert range_decision("L2", second, limits, done) == "fail"


def test_a_skipped_standoff_forbids_pass_but_not_fail() -> None:
    done = Completeness(len(STANDOFFS_MM) - 1, (Placement(key="p.1/500mm", standoff_mm=500.0),))
    for bounds, decision in (([-0.5, 0.5], "neither"), ([0.4, 0.5], "fail")):
        limits = AccuracyLimits.model_validate({"mean_relative_error": {"in": bounds}})
        assert verdict_of(RANGES, limits, done).decision == decision
    assert "5 of 6" in verdict_of(RANGES, AccuracyLimits(), done).text
