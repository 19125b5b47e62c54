"""Dither: the target is moved sideways between repeats, so that the speckle of its spots changes."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.prompt import Prompt
from workbench.model.target import FlatTarget, Placement
from workbench.procedure.engine.context import Context


def dither_prompts(placement: Placement, repeats: int, dither_mm: float | None) -> Sequence[Prompt]:
    """Prompts before the second and each further repeat at a placement; none without dither."""
    if dither_mm is None:
        return ()
    return [_prompt(placement, number, dither_mm) for number in range(1, repeats)]


def dither(context: Context, placement: Placement, number: int, dither_mm: float | None) -> None:
    """Have the target moved before repeat `number` (from 0) at a placement; the first needs no move.

    A placement that is replayed from disk moves nothing.

    Raises:
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    if dither_mm is None or number == 0:
        return
    context.ask(_prompt(placement, number, dither_mm))
    if context.pairs.replayed is None:
        target = FlatTarget(shift_mm=number * dither_mm)
        context.bench.target.place(placement.model_copy(update={"target": target}))


def _prompt(placement: Placement, number: int, dither_mm: float) -> Prompt:
    return Prompt(
        key=f"{placement.key}/dither-{number:02d}",
        do=f"Move the target {dither_mm:g} mm sideways along its own face (repeat {number + 1}).",
        expect="Its distance has not changed, and every spot lies on it.",
        otherwise="If its distance changed, place it at the standoff again.",
        at_bench=True,
    )
