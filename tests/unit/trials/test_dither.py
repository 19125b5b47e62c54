"""Dither of the target between repeats."""

from __future__ import annotations

from pathlib import Path

from tests.support.running import Scripted, running
from workbench.model.event import Answered
from workbench.procedure.engine.step import flat_placement
from workbench.trials.dither import dither, dither_prompts

PLACEMENT = flat_placement("p.1", 500.0, 2)


def test_each_further_repeat_has_a_prompt_at_the_bench() -> None:
    prompts = dither_prompts(PLACEMENT, 3, 2.0)
    assert [one.key for one in prompts] == ["p.1/02-500mm/dither-01", "p.1/02-500mm/dither-02"]
    assert all(one.at_bench for one in prompts)
    assert not dither_prompts(PLACEMENT, 3, None)


def test_the_target_moves_before_the_second_repeat(tmp_path: Path) -> None:
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        for number in (0, 1):
            dither(session.context, PLACEMENT, number, 2.0)
        dither(session.context, PLACEMENT, 1, None)
        assert [e.key for e in session.events if isinstance(e, Answered)] == ["p.1/02-500mm/dither-01"]
    assert operator.keys == ["p.1/02-500mm/dither-01"]


def test_prompts_agree_with_the_questions_that_are_asked(tmp_path: Path) -> None:
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        for number in range(4):
            dither(session.context, PLACEMENT, number, 1.5)
    assert operator.asked == list(dither_prompts(PLACEMENT, 4, 1.5))
