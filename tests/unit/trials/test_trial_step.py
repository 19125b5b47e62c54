"""Base class of the steps of trials."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import four_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.target import Placement
from workbench.trials.trial_step import outside_prompt

TRIALS = {
    "accuracy": ("standoffs_mm: [300], readings: 1", "mean_error_mm"),
    "repeatability": ("standoffs_mm: [300]", "reproducibility_sd_mm"),
    "gauge_rr": ("standoffs_mm: [300, 500], operators: [A, B]", "study_variation"),
    "incline": (
        "ranges_mm: [300], targets: [{kind: incline, angle_deg: 30}], readings: 1",
        "angle_error_deg",
    ),
    "round": ("ranges_mm: [300], target: {kind: cylinder, diameter_mm: 178}, readings: 1", "radius_error_mm"),
    "missing_spots": ("ranges_mm: [300], missing: [1], readings: 1", "ratio"),
    "verify": ("standoffs_mm: [300], readings: 1", "error_mm"),
}


@pytest.mark.parametrize("trial", TRIALS)
def test_every_trial_needs_a_calibration_and_has_limits(trial: str) -> None:
    keys, limit = TRIALS[trial]
    text = f"step: {trial}_trial, {keys}, limits: {{{limit}: {{in: [0, 1], on_fail: ask}}}}"
    step = parse_step(text)
    assert step.needs == "calibration"
    prompts = [prompt.key for prompt in step.prompts("p.1", four_laser_rig())]
    assert f"p.1/{limit}" in prompts
    outside = [key for key in prompts if key.endswith("/outside")]
    assert len(outside) == len(step.placements("p.1", four_laser_rig()))


@pytest.mark.parametrize("trial", TRIALS)
@pytest.mark.parametrize("limit", ["unknown: {in: [0, 1]}", "LIMIT: {in: [0, 1], on_fail: retry}"])
def test_unknown_limits_and_retries_are_refused(trial: str, limit: str) -> None:
    keys, known = TRIALS[trial]
    text = f"step: {trial}_trial, {keys}, limits: {{{limit.replace('LIMIT', known)}}}"
    (key,) = wrong_keys(text)
    assert key.startswith("steps[0].limits")


def test_readings_outside_may_be_taken_again_or_left_out() -> None:
    prompt = outside_prompt(Placement(key="p.1/300mm", standoff_mm=300.0), "found")
    assert set(prompt.may) == {"redo", "skip"}
    assert not prompt.at_bench
