"""Prompts that every procedure puts."""

from __future__ import annotations

import re

import pytest

from tests.support.running import two_laser_rig
from workbench.model.prompt import Answer
from workbench.model.target import BoardTarget, Placement
from workbench.procedure.engine.prompts import (
    captures_prompt,
    placement_prompt,
    placement_prompts,
    safety_prompt,
)


@pytest.mark.parametrize(
    ("standoff_mm", "before_mm", "may"),
    [
        (900.0, None, {"skip": "leave 900 mm out"}),
        (900.0, 600.0, {"redo": "600 mm again", "skip": "leave 900 mm out"}),
        (900.0, 900.0, {"redo": "the one before", "skip": "leave this one out"}),
    ],
)
def test_a_placement_prompt_says_which_is_captured_again_and_which_left_out(
    standoff_mm: float, before_mm: float | None, may: dict[str, str]
) -> None:
    before = None if before_mm is None else Placement(key="b", standoff_mm=before_mm)
    assert placement_prompt(Placement(key="a", standoff_mm=standoff_mm), before).may == may


def test_a_standoff_within_a_tenth_is_no_slip() -> None:
    prompt = placement_prompt(Placement(key="a", standoff_mm=500.0), None)
    for value, fits in ((450.0, True), (550.0, True), (449.0, False), (551.0, False)):
        assert (prompt.refuse(Answer(value=value)) is None) is fits
    assert prompt.quantity is not None
    assert prompt.quantity.usual == 500.0


def test_only_somebody_at_the_bench_answers_for_safety_and_placements() -> None:
    assert safety_prompt(two_laser_rig()).at_bench
    assert placement_prompt(Placement(key="a", standoff_mm=500.0), None).at_bench
    captures = captures_prompt("a/L1/snr", "snr", Placement(key="a", standoff_mm=500.0))
    assert not captures.at_bench
    assert set(captures.may) == {"redo", "skip"}


def test_each_placement_may_have_the_one_before_it_captured_again() -> None:
    prompts = placement_prompts([Placement(key=f"{mm}", standoff_mm=mm) for mm in (300.0, 500.0, 700.0)])
    assert [set(prompt.may) for prompt in prompts] == [{"skip"}, {"redo", "skip"}, {"redo", "skip"}]


def test_the_safety_prompt_names_the_rigs_laser_class() -> None:
    rig = two_laser_rig()
    asked = {one: safety_prompt(rig.model_copy(update={"laser_class": one})).do for one in ("2", "3R", "3B")}
    assert all(f" {one} " in text for one, text in asked.items())
    assert asked["2"].replace(" 2 ", " 3R ") != asked["3R"]
    assert asked["3B"].replace(" 3B ", " 3R ") == asked["3R"]


@pytest.mark.parametrize(
    ("yaw_deg", "pitch_deg", "numbers"), [(0, 0, []), (20, 0, ["20"]), (-20, 15, ["20", "15"])]
)
def test_a_board_is_asked_for_with_its_angles(yaw_deg: float, pitch_deg: float, numbers: list[str]) -> None:
    board = BoardTarget(yaw_deg=yaw_deg, pitch_deg=pitch_deg)
    text = placement_prompt(Placement(key="a", standoff_mm=700.0, target=board), None).do
    assert re.findall(r"\d+", text) == ["700", *numbers]
    assert "board" in text
