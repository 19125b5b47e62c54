"""Step `repeatability_trial`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.trials.repeatability.step import JOINT_ALARM, RepeatabilityTrialStep

PROCEDURE = Path(__file__).parents[4] / "procedures/repeatability.yaml"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("standoffs_mm: []", ["steps[0].standoffs_mm"]),
        ("standoffs_mm: [300, 300]", ["steps[0]"]),
        ("standoffs_mm: [300], placements: 1", ["steps[0].placements"]),
        ("standoffs_mm: [300], repeats: 1", ["steps[0].repeats"]),
        ("standoffs_mm: [300], dither_mm: 0", ["steps[0].dither_mm"]),
        ("standoffs_mm: [300], readings: 3", ["steps[0].readings"]),
    ],
)
def test_a_design_without_degrees_of_freedom_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: repeatability_trial, {text}") == keys


def test_the_target_leaves_each_standoff_between_its_placements() -> None:
    step, rig = (
        parse_step("step: repeatability_trial, standoffs_mm: [300, 700], placements: 2"),
        two_laser_rig(),
    )
    assert (step.needs, step.gives) == ("calibration", None)
    assert [one.key for one in step.placements("p.1", rig)] == [
        "p.1/01-300mm",
        "p.1/01-700mm",
        "p.1/02-300mm",
        "p.1/02-700mm",
    ]
    assert step.captures(rig) == 2 * 2 * 3
    assert len(step.prompts("p.1", rig)) == 2 * 4


def test_default_design_is_that_of_iso_5725() -> None:
    step, rig = parse_step("step: repeatability_trial, standoffs_mm: [300]"), two_laser_rig()
    assert (len(step.placements("p.1", rig)), step.captures(rig)) == (8, 24)


def test_title_gives_the_degrees_of_freedom_of_each_component() -> None:
    step = parse_step("step: repeatability_trial, standoffs_mm: [300], placements: 5, repeats: 4")
    assert "(15 degrees of freedom)" in step.title
    assert "(4)" in step.title
    dithered = parse_step("step: repeatability_trial, standoffs_mm: [300], dither_mm: 2")
    assert "speckle" in dithered.title
    assert "speckle" not in step.title


@pytest.mark.parametrize(("standoffs_mm", "placements"), [("[300]", 8), ("[300, 800, 2000]", 10)])
def test_the_power_of_the_budget_is_that_of_drawn_variances(standoffs_mm: str, placements: int) -> None:
    """20 000 draws of twice the stated variance: the sd of their share is 0.004 at most."""
    step = parse_step(f"step: repeatability_trial, standoffs_mm: {standoffs_mm}, placements: {placements}")
    assert isinstance(step, RepeatabilityTrialStep)
    freedom = len(step.standoffs_mm) * (placements - 1)
    drawn = 2.0 * np.random.default_rng(8).chisquare(freedom, 20_000)
    assert step.budget_power == pytest.approx(np.mean(chi2.sf(drawn, freedom) < JOINT_ALARM), abs=0.016)


def test_the_procedure_has_placements_enough_for_a_power_of_80_percent() -> None:
    (step,) = load_procedure(PROCEDURE).steps
    assert isinstance(step, RepeatabilityTrialStep)
    assert step.budget_power > 0.8


def test_dither_prompts_can_be_answered_in_advance() -> None:
    step = parse_step(
        "step: repeatability_trial, standoffs_mm: [300], placements: 2, repeats: 3, dither_mm: 2"
    )
    keys = [prompt.key for prompt in step.prompts("p.1", two_laser_rig())]
    assert [key for key in keys if "dither" in key] == [
        f"p.1/0{placement}-300mm/dither-0{number}" for placement in (1, 2) for number in (1, 2)
    ]
