"""Step `capture_grid`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.event import CaptureTaken, StandoffAdvised
from workbench.model.prompt import Answer

TEXT = "step: capture_grid, standoffs_mm: [300, 600, 1500], repeats: 2"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("standoffs_mm: [300, 300], repeats: 1", ["steps[0]"]),
        ("standoffs_mm: [300, 300.00000000000006], repeats: 1", ["steps[0]"]),
        ("standoffs_mm: [], repeats: 1", ["steps[0].standoffs_mm"]),
        ("standoffs_mm: [-3], repeats: 0", ["steps[0].standoffs_mm[0]", "steps[0].repeats"]),
        ("standoffs_mm: [3], repeats: 1, limits: {rms_px: {in: [0, 1]}}", ["steps[0].limits.rms_px"]),
        ("standoffs_mm: [3], repeats: 1, limits: {snr: {in: [2, 1]}}", ["steps[0].limits.snr"]),
    ],
)
def test_a_grid_that_cannot_be_is_refused(text: str, keys: list[str]) -> None:
    assert wrong_keys(f"step: capture_grid, {text}") == keys


def test_it_gives_captures_of_each_laser_at_each_standoff() -> None:
    step, rig = parse_step(TEXT), two_laser_rig()
    assert (step.needs, step.gives) == (None, "captures")
    assert [one.standoff_mm for one in step.placements("p.1", rig)] == [300.0, 600.0, 1500.0]
    assert step.captures(rig) == 3 * 2 * len(rig.lasers)
    assert [word for word in step.title.split() if word.isdigit()] == ["3", "2"]


def test_prompts_are_those_of_placements_and_of_limits_that_ask() -> None:
    limits = "limits: {snr: {in: [5, null], on_fail: ask}}"
    step = parse_step(f"step: capture_grid, standoffs_mm: [300, 600], repeats: 1, {limits}")
    keys = [prompt.key for prompt in step.prompts("p.1", two_laser_rig())]
    assert keys[:2] == ["p.1/300mm", "p.1/600mm"]
    assert keys[2:6] == [f"p.1/{mm}mm/{one}/snr" for mm in (300, 600) for one in ("L1", "L2")]
    assert keys[6:] == ["p.1/300mm/standoff", "p.1/600mm/standoff"]


def test_prompts_of_added_placements_are_those_of_placements_and_of_limits_that_ask() -> None:
    limits = "limits: {snr: {in: [5, null], on_fail: ask}}"
    step = parse_step(f"step: capture_grid, standoffs_mm: [300, 600], repeats: 1, {limits}")
    keys = [prompt.key for prompt in step.added_prompts("p.1", two_laser_rig(), (600.0,))]
    key = "p.1/02-600mm"
    assert keys == [key, f"{key}/L1/snr", f"{key}/L2/snr", f"{key}/standoff"]


def test_it_counts_the_pairs_that_it_took(tmp_path: Path) -> None:
    skip = Answer(action="skip", reason="no room")
    step = parse_step("step: capture_grid, standoffs_mm: [400, 600], repeats: 2")
    with running(tmp_path, operator=Scripted({"p.1/600mm": [skip]})) as session:
        assert step.run(session.context, "p.1") == "4 pairs"
        taken = [event for event in session.events if isinstance(event, CaptureTaken)]
    assert {event.standoff_mm for event in taken} == {400.0}
    assert [(event.purpose, event.laser_id) for event in taken] == [("calibration", "L1")] * 2 + [
        ("calibration", "L2")
    ] * 2


def test_prompts_name_the_lasers_outside_the_image(tmp_path: Path) -> None:
    operator = Scripted()
    step = parse_step("step: capture_grid, standoffs_mm: [60, 600], repeats: 1")
    with running(tmp_path, operator=operator) as session:
        step.run(session.context, "p.1")
    expected = {prompt.key: prompt.expect for prompt in operator.asked}
    assert expected["p.1/60mm"].endswith("By the rig file L1, L2 will be outside the image.")
    assert "outside" not in expected["p.1/600mm"]


def test_the_next_standoff_is_advised_where_a_fit_follows(tmp_path: Path) -> None:
    grid, fit = (
        parse_step("step: capture_grid, standoffs_mm: [300, 900], repeats: 1"),
        parse_step("step: fit"),
    )
    with running(tmp_path) as session:
        session.context.steps = (grid,)
        grid.run(session.context, "p.1")
        assert "standoff_advised" not in session.kinds
        session.context.steps = (grid, fit)
        grid.run(session.context, "p.2")
        advised = [event for event in session.events if isinstance(event, StandoffAdvised)]
    assert advised
    assert {event.limit for event in advised} == {fit.limits.max_relative_range_sd}
    assert all(event.then_relative_range_sd <= event.relative_range_sd * (1 + 1e-9) for event in advised)
