"""Prompts that every procedure puts."""

from __future__ import annotations

import pytest

from workbench.model.target import Placement
from workbench.procedure.engine.prompts import placement_prompt


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
