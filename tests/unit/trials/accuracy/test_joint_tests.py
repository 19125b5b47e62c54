"""Tests of the error budget of all ranges together."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.support.accuracy_runs import accuracy_run
from tests.support.rangers import IDS, thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.trials.accuracy.joint_tests import BUDGET_ALARM, joint_tests
from workbench.trials.accuracy.ranges import CLOSEST, MEAN

RANGES = accuracy_run(SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1))


def test_all_tests_of_a_trial_share_one_probability_of_an_alarm() -> None:
    tests = joint_tests(RANGES)
    assert [one.name for one in tests if one.note == "all standoffs"] == [CLOSEST, MEAN, *IDS]
    assert [one.name for one in tests if one.note == "repeats"] == [MEAN, *IDS]
    assert sum(one.level for one in tests) == pytest.approx(BUDGET_ALARM)


def test_an_alarm_is_a_probability_below_its_share() -> None:
    (one, *_) = joint_tests(RANGES)
    assert replace(one, probability=0.99 * one.level).alarm
    assert not replace(one, probability=1.01 * one.level).alarm


def test_noise_that_no_source_states_is_an_alarm_of_the_repeats() -> None:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 2)
    noisy = bench.with_unknown(noise_px=3 * bench.ranger.calibration.laser_ranger.noise.spot_sd_px)
    found = {(one.name, one.note): one.alarm for one in joint_tests(accuracy_run(noisy))}
    assert found[MEAN, "repeats"]
