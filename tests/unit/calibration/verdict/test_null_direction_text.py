"""Null directions in words: kinds, units, groups, and which remedy fits."""

from __future__ import annotations

from math import hypot

import pytest

from tests.support.rigs import prior, thesis_rig
from workbench.calibration.model.parameters import PRINT, REFERENCE
from workbench.calibration.verdict.null_direction_text import (
    ACROSS,
    APART,
    BASELINE,
    BOARD,
    LEAST_PART,
    NO_EFFECT,
    POINTING,
    REMEDIES,
    SQUARE,
    ParameterChange,
    ParameterGroup,
    describe,
    group_by_kind,
    own_laser,
    parameter_change,
    remedy,
)

RIG = thesis_rig()


def change(name: str, effect: float, step: float = 1.0, value: float = 100.0) -> ParameterChange:
    return parameter_change(RIG, name, value, step, effect)


@pytest.mark.parametrize(
    ("name", "value", "step", "kind", "shown", "unit"),
    [
        ("f_px", 500.0, 5.0, "f_px", 1.0, "%"),
        ("L1.x_mm", -60.0, 0.6, BASELINE, -1.0, "%"),
        ("L1.x_mm", 0.0, 0.6, BASELINE, 0.6, "mm"),
        ("L1.y_mm", 0.2, 0.1, ACROSS, 0.1, "mm"),
        ("L2.tx", 0.0, 0.002, POINTING["tx"], 2.0, "mrad"),
        ("ruler_scale", 0.0, 0.0005, "ruler_scale", 0.05, "%"),
        ("cx_px", 320.0, 2.0, "cx_px", 2.0, "px"),
        ("offset_mm", 0.0, 1.5, "offset_mm", 1.5, "mm"),
        ("target_slope_x", 0.0, 0.01, "target_slope_x", 0.57294, "deg"),
        ("target_slope_y", 1.0, 0.01, "target_slope_y", 0.28505, "deg"),
        ("drift_v_px", 0.0, 0.2, "drift_v_px", 0.2, "px"),
        ("k1", 0.0, 0.1, "k1", 0.1, ""),
    ],
)
def test_a_change_is_shown_in_the_unit_of_its_kind(
    name: str, value: float, step: float, kind: str, shown: float, unit: str
) -> None:
    found = parameter_change(RIG, name, value, step, 3.0)
    assert (found.kind, found.unit, found.effect) == (kind, unit, 3.0)
    assert found.shown == pytest.approx(shown, rel=1e-4)
    assert found.laser == name.rpartition(".")[0]


def test_the_baseline_of_a_laser_above_is_along_v() -> None:
    upright = RIG.lasers[0].model_copy(update={"x_mm": prior(0.0, 0.2), "y_mm": prior(45.0, 0.2)})
    rig = RIG.model_copy(update={"lasers": (upright, *RIG.lasers[1:])})
    kinds = [parameter_change(rig, f"L1.{name}", 45.0, 1.0, 1.0).kind for name in ("x_mm", "y_mm")]
    assert kinds == [ACROSS, BASELINE]


def test_what_moves_together_is_one_group_a_kind_and_lasers_come_last() -> None:
    parts = [change("L1.x_mm", 4.0), change("L2.x_mm", 3.0), change("f_px", 5.0)]
    groups = group_by_kind(parts)
    assert [g.kind for g in groups] == ["f_px", BASELINE]
    assert groups[1].lasers == ("L1", "L2")
    assert groups[1].effect == pytest.approx(hypot(4.0, 3.0))
    assert groups[0].lasers == ()


def test_weak_parts_are_not_named_and_no_more_than_three_others_are() -> None:
    strong = [change(name, effect) for name, effect in (("f_px", 10.0), ("cx_px", 9.0), ("k1", 8.0))]
    others = [change("k2", 7.0), change("cy_px", 6.0), change("offset_mm", LEAST_PART * 10 * 0.99)]
    assert {g.kind for g in group_by_kind([*strong, *others])} == {"f_px", "cx_px", "k1", "k2"}
    members = group_by_kind([change("L1.tx", 10.0), change("L2.tx", 2.9), change("L3.tx", 3.1)])[0].members
    assert [m.laser for m in members] == ["L1", "L3"]


def test_the_first_is_named_however_weak_and_nothing_beside_it_that_has_no_effect() -> None:
    groups = group_by_kind([change("k3", 0.001), change("k1", 0.005)])
    assert [g.kind for g in groups] == ["k3"]


@pytest.mark.parametrize(("signs", "begins"), [((1, 1), "+1"), ((-1, -1), "-1"), ((1, -1), "+-1")])
def test_the_size_says_whether_all_go_one_way(signs: tuple[int, int], begins: str) -> None:
    members = tuple(
        change(f"L{n}.tx", 1.0, sign * 1e-3 * n / 1.5) for n, sign in zip((1, 2), signs, strict=True)
    )
    assert ParameterGroup(members).size.split() == [begins, "mrad"]


def test_all_lasers_are_not_listed_and_some_are() -> None:
    of_all = group_by_kind(change(f"L{n}.x_mm", 1.0) for n in (1, 2, 3, 4))
    of_two = group_by_kind(change(f"L{n}.x_mm", 1.0) for n in (2, 3))
    assert "L2" not in describe(RIG, of_all)
    assert "L2, L3" in describe(RIG, of_two)
    assert "L1, L4" in describe(RIG, of_two, ("L1", "L4"))


def test_several_parameters_are_a_list() -> None:
    groups = group_by_kind([change("k1", 10.0), change("k2", 9.0), change("cx_px", 8.0)])
    assert describe(RIG, groups).startswith("k1, k2 and cx_px ")
    assert describe(RIG, groups[:2]).startswith("k1 and k2 ")


def test_a_better_ruler_is_the_remedy_wherever_a_length_s_scale_takes_part() -> None:
    groups = group_by_kind([change("f_px", 3.0), change("ruler_scale", 3.0), change("L1.x_mm", 3.0)])
    assert (remedy(groups),) == REMEDIES["ruler_scale"]


def test_remedies_are_those_of_the_kinds_each_once() -> None:
    groups = group_by_kind([change("f_px", 3.0), change("k1", 3.0), change("L1.x_mm", 3.0)])
    assert remedy(groups).split(" or ") == [*REMEDIES[BASELINE], *REMEDIES["f_px"]]


def test_a_common_tilt_is_measured_or_seen_on_the_board_and_each_remedy_stands_once() -> None:
    with_baselines = group_by_kind([change("target_slope_x", 3.0), change("L1.x_mm", 3.0)])
    assert set(remedy(with_baselines).split(" or ")) == {SQUARE, BOARD, *REMEDIES[BASELINE]}
    with_centre = group_by_kind([change("target_slope_x", 3.0), change("cx_px", 3.0), change("L1.tx", 3.0)])
    assert remedy(with_centre).split(" or ") == [SQUARE, BOARD]


@pytest.mark.parametrize("name", [*REFERENCE, *PRINT])
def test_what_the_bench_adds_is_no_term_of_the_lens(name: str) -> None:
    words = describe(RIG, group_by_kind([change(name, 3.0)]))
    assert name in words
    assert "lens" not in words


def test_one_kind_has_no_remedy_and_lasers_by_themselves_want_other_standoffs() -> None:
    alone = group_by_kind([change("k3", 1.0)])
    pair = group_by_kind([change("L1.tx", 1.0), change("L1.x_mm", 1.0)])
    assert remedy(alone) == NO_EFFECT
    assert remedy(pair, ("L1", "L2")) == APART


def test_a_direction_is_a_laser_s_own_where_no_other_and_nothing_shared_takes_part() -> None:
    own = group_by_kind([change("L1.tx", 1.0), change("L1.x_mm", 1.0)])
    shared = group_by_kind([change("L1.tx", 1.0), change("cx_px", 1.0)])
    two = group_by_kind([change("L1.tx", 1.0), change("L2.tx", 1.0)])
    assert [own_laser(RIG, groups) for groups in (own, shared, two)] == ["L1", "", ""]
    single = RIG.model_copy(update={"lasers": RIG.lasers[:1]})
    assert own_laser(single, own) == ""
