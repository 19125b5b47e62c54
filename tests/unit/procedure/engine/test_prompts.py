"""Prompts common to all procedures."""

from __future__ import annotations

import re

import pytest

from tests.support.running import two_laser_rig
from workbench.model.prompt import Answer
from workbench.model.rig import Rig
from workbench.model.target import BoardTarget, CylinderTarget, FlatTarget, Placement
from workbench.procedure.engine.prompts import (
    SPECULAR,
    captures_prompt,
    laser_class_prompt,
    placement_prompt,
    placement_prompts,
    safety_prompt,
    standoff_prompt,
)


@pytest.mark.parametrize(
    ("before_mm", "standoffs"),
    [
        (None, {"skip": ["900"]}),
        (600.0, {"redo": ["600"], "skip": ["900"]}),
        (900.0, {"redo": [], "skip": []}),  # the standoff does not distinguish them
    ],
)
def test_a_placement_prompt_names_the_standoffs_of_redo_and_skip(
    before_mm: float | None, standoffs: dict[str, list[str]]
) -> None:
    before = None if before_mm is None else Placement(key="b", standoff_mm=before_mm)
    may = placement_prompt(Placement(key="a", standoff_mm=900.0), before).may
    assert {action: re.findall(r"\d+", text) for action, text in may.items()} == standoffs


def test_a_target_that_stands_as_requested_is_taken_away_first() -> None:
    board = BoardTarget(yaw_deg=20.0)
    flat, turned = (Placement(key="a", standoff_mm=500.0, target=one) for one in (FlatTarget(), board))
    for placement in (flat, turned):
        before = placement.model_copy(update={"key": "b"})
        again = placement_prompt(placement, before).do
        assert again != placement_prompt(placement, None).do
        assert "away and place it again" in again
        for other in (
            before.model_copy(update={"standoff_mm": 501.0}),
            turned if placement is flat else flat,
        ):
            assert placement_prompt(placement, other).do == placement_prompt(placement, None).do


def test_a_standoff_within_a_tenth_is_no_slip() -> None:
    prompt = placement_prompt(Placement(key="a", standoff_mm=500.0), None)
    for value, fits in ((450.0, True), (550.0, True), (449.0, False), (551.0, False)):
        assert (prompt.refuse(Answer(value=value)) is None) is fits
    assert prompt.quantity is not None
    assert prompt.quantity.usual == 500.0


def test_safety_and_placements_need_a_person_at_the_bench() -> None:
    assert safety_prompt(two_laser_rig()).at_bench
    assert placement_prompt(Placement(key="a", standoff_mm=500.0), None).at_bench
    captures = captures_prompt("a/L1/snr", "snr", Placement(key="a", standoff_mm=500.0))
    assert not captures.at_bench
    assert set(captures.may) == {"redo", "skip"}


def test_redo_is_possible_after_the_first_placement() -> None:
    prompts = placement_prompts([Placement(key=f"{mm}", standoff_mm=mm) for mm in (300.0, 500.0, 700.0)])
    assert [set(prompt.may) for prompt in prompts] == [{"skip"}, {"redo", "skip"}, {"redo", "skip"}]


def test_the_safety_prompt_names_the_rigs_laser_class() -> None:
    rig = two_laser_rig()
    asked = {one: safety_prompt(rig.model_copy(update={"laser_class": one})).do for one in ("2", "3R", "3B")}
    assert all(f" {one} " in text for one, text in asked.items())
    assert asked["2"].replace(" 2 ", " 3R ") != asked["3R"]
    assert asked["3B"].replace(" 3B ", " 3R ") == asked["3R"]


def test_a_laser_class_that_is_not_stated_is_not_assumed() -> None:
    prompt = safety_prompt(two_laser_rig().model_copy(update={"laser_class": None}))
    assert not re.search(r"class \d", prompt.do)
    assert "laser_class" in prompt.do


def test_the_classes_to_choose_from_are_those_of_a_rig_file() -> None:
    prompt = laser_class_prompt()
    assert prompt.choices
    assert prompt.at_bench
    for choice in prompt.choices:
        data = two_laser_rig().model_dump(exclude_unset=True) | {"laser_class": choice}
        assert Rig.model_validate(data).laser_class == choice


@pytest.mark.parametrize(
    ("yaw_deg", "pitch_deg", "numbers"), [(0, 0, []), (20, 0, ["20"]), (-20, 15, ["20", "15"])]
)
def test_the_prompt_of_a_board_states_its_angles(
    yaw_deg: float, pitch_deg: float, numbers: list[str]
) -> None:
    board = BoardTarget(yaw_deg=yaw_deg, pitch_deg=pitch_deg)
    text = placement_prompt(Placement(key="a", standoff_mm=700.0, target=board), None).do
    assert re.findall(r"\d+", text) == ["700", *numbers]
    assert "board" in text


@pytest.mark.parametrize(
    ("target", "nearer"),
    [
        (FlatTarget(yaw_deg=30.0, turn_sd_deg=0.15), "left"),
        (FlatTarget(yaw_deg=-30.0, turn_sd_deg=0.15), "right"),
        (FlatTarget(pitch_deg=30.0, turn_sd_deg=0.15), "upper"),
        (FlatTarget(pitch_deg=-30.0, turn_sd_deg=0.15), "lower"),
    ],
)
def test_the_prompt_of_an_incline_names_the_nearer_side_and_its_uncertainty(
    target: FlatTarget, nearer: str
) -> None:
    placement = Placement(key="a", standoff_mm=400.0, target=target, standoff_sd_mm=0.35)
    prompt = placement_prompt(placement, None)
    assert f"{nearer} side is nearer" in prompt.do
    assert {"30", "0.15", "0.35"} <= set(prompt.do.split())
    assert "square" not in prompt.expect
    assert "square" in placement_prompt(Placement(key="a", standoff_mm=400.0), None).expect


def test_the_prompt_of_a_cylinder_warns_of_reflections_and_names_its_axis() -> None:
    target = CylinderTarget(diameter_mm=178.0, shift_mm=20.0, diameter_sd_mm=0.15)
    prompt = placement_prompt(Placement(key="a", standoff_mm=400.0, target=target), None)
    assert SPECULAR in prompt.do
    assert {"178", "20", "0.15"} <= set(prompt.do.split())
    assert SPECULAR not in placement_prompt(Placement(key="a", standoff_mm=400.0), None).do


def test_a_confirmation_at_a_failed_check_overrules_it() -> None:
    placement = Placement(key="a", standoff_mm=500.0)
    for prompt in (
        captures_prompt("a/L1/snr", "snr", placement),
        standoff_prompt(placement),
    ):
        assert prompt.overrules
    assert not placement_prompt(placement, None).overrules


@pytest.mark.parametrize(
    ("target", "sd_mm", "measured"),
    [
        (FlatTarget(), None, True),
        (FlatTarget(), 0.5, True),
        (FlatTarget(), 600.0, False),
        (FlatTarget(yaw_deg=20.0), 600.0, False),
        (BoardTarget(yaw_deg=20.0), 600.0, False),
        (BoardTarget(), None, True),
    ],
)
def test_only_a_measured_standoff_is_to_be_read_off_the_ruler(
    target: FlatTarget | BoardTarget, sd_mm: float | None, measured: bool
) -> None:
    placement = Placement(key="a", standoff_mm=600.0, target=target, standoff_sd_mm=sd_mm)
    prompt = placement_prompt(placement, None)
    text = " ".join((prompt.do, prompt.expect, prompt.otherwise))
    assert ("ruler" in text) == measured
    assert ("need not be measured" in text) != measured
