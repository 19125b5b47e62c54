"""What every step is by default, and keys of flat placements."""

from __future__ import annotations

from typing import Literal

from tests.support.running import two_laser_rig
from workbench.procedure.engine.step import COMPUTING_S, StepModel, flat_placement


class Plain(StepModel):
    step: Literal["plain_kind"]


def test_a_step_has_no_placements_captures_and_prompts_unless_it_says_so() -> None:
    plain, rig = Plain(step="plain_kind"), two_laser_rig()
    assert list(plain.placements("p.1", rig)) == []
    assert list(plain.prompts("p.1", rig)) == []
    assert plain.captures(rig) == 0
    assert plain.default_duration_s == COMPUTING_S
    assert (plain.needs, plain.gives) == (None, None)


def test_standoffs_that_differ_by_12_digits_have_keys_that_differ() -> None:
    keys = {flat_placement("p.1", mm).key for mm in (300.0, 300.000000001, 1000000.0)}
    assert keys == {"p.1/300mm", "p.1/300.000000001mm", "p.1/1000000mm"}
    assert flat_placement("p.1", 300.0).standoff_mm == 300.0
