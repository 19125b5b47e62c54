"""Step `gauge_rr_trial`."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys

DESIGN = "step: gauge_rr_trial, standoffs_mm: [300, 700], operators: [Ann, Bob], trials: 2"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("standoffs_mm: [300], operators: [A, B]", ["steps[0].standoffs_mm"]),
        ("standoffs_mm: [300, 300], operators: [A, B]", ["steps[0]"]),
        ("standoffs_mm: [300, 700], operators: [A]", ["steps[0].operators"]),
        ("standoffs_mm: [300, 700], operators: [A, A]", ["steps[0]"]),
        ("standoffs_mm: [300, 700], operators: [A, ' ']", ["steps[0]"]),
        ("standoffs_mm: [300, 700], operators: [A, B], trials: 1", ["steps[0].trials"]),
        ("standoffs_mm: [300, 700], operators: [A, B], readings: 0", ["steps[0].readings"]),
    ],
)
def test_a_study_without_degrees_of_freedom_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: gauge_rr_trial, {text}") == keys


def test_every_operator_visits_every_standoff_in_each_trial() -> None:
    step, rig = parse_step(DESIGN), two_laser_rig()
    rounds = list(step.rounds("p.1"))
    assert [(one.operator, one.trial) for one in rounds] == [("Ann", 1), ("Bob", 1), ("Ann", 2), ("Bob", 2)]
    assert [one.key for one in rounds[2].placements] == ["p.1/03-300mm", "p.1/03-700mm"]
    assert len({one.key for one in step.placements("p.1", rig)}) == 8
    assert step.captures(rig) == 8
    assert parse_step(f"{DESIGN}, readings: 3").captures(rig) == 24


def test_each_change_of_operator_is_a_prompt() -> None:
    step = parse_step(DESIGN)
    keys = [prompt.key for prompt in step.prompts("p.1", two_laser_rig())]
    assert [key for key in keys if "operator" in key] == [
        f"p.1/operator-0{number}" for number in (1, 2, 3, 4)
    ]
    assert "Bob" in list(step.rounds("p.1"))[1].prompt.do


def test_title_names_design_and_components() -> None:
    title = parse_step(DESIGN).title
    assert all(word in title for word in ("2 standoffs", "2 operators", "2 placements", "interaction"))


@pytest.mark.parametrize(("operators", "dofs"), [("A, B", [8, 1, 3]), ("A, B, C", [12, 2, 6])])
def test_title_has_the_degrees_of_freedom_of_each_component(operators: str, dofs: list[int]) -> None:
    """8 = 4 standoffs x 2 operators x (2 - 1) placements."""
    text = f"step: gauge_rr_trial, standoffs_mm: [480, 490, 500, 510], operators: [{operators}], trials: 2"
    title = parse_step(text).title
    found = [int(number) for number in re.findall(r"\((\d+)", title)]
    assert found == dofs
    widest = float(np.sqrt(dofs[1] / chi2.ppf(0.025, dofs[1])))
    assert f"{widest:.2g} times" in title
