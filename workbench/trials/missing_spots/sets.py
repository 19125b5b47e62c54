"""Sets of lasers whose spots are missing, and how: left off, or their beams blocked before the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from workbench.model.prompt import Prompt
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context

Cause = Literal["off", "blocked"]


@dataclass(frozen=True)
class Condition:
    """Number of missing spots, and their cause."""

    number: int
    cause: Cause = "off"

    @property
    def name(self) -> str:
        """Name in charts and messages: `all lasers`, `1 off`, `3 blocked`."""
        return f"{self.number} {self.cause}" if self.number else "all lasers"


ALL = Condition(0)
"""Every spot is present."""


def missing_sets(laser_ids: Sequence[str], condition: Condition, readings: int) -> list[tuple[str, ...]]:
    """Lasers without a spot at each of n readings: every set of that size, as equally often as possible.

    Lasers are left off in turn. Blocked sets follow each other, so that each is blocked once.

    Args:
        laser_ids: lasers of the rig.
        condition: number of lasers in a set, and the cause.
        readings: n.
    """
    sets = list(combinations(laser_ids, condition.number))
    turns = [number % len(sets) for number in range(readings)]
    return [sets[turn] for turn in (sorted(turns) if condition.cause == "blocked" else turns)]


def block_prompts(
    placement: Placement, laser_ids: Sequence[str], numbers: Sequence[int], readings: int
) -> list[Prompt]:
    """Prompts at a placement to block beams, one for each set, and to free them at the end; none without."""
    conditions = [Condition(number, "blocked") for number in numbers]
    sets = [ids for one in conditions for ids in dict.fromkeys(missing_sets(laser_ids, one, readings))]
    return [_block_prompt(placement, ids) for ids in sets] + ([_free_prompt(placement)] if sets else [])


def block(context: Context, placement: Placement, laser_ids: tuple[str, ...]) -> None:
    """Have the beams of lasers blocked at a placement; none: have all freed.

    A placement that is replayed from disk moves nothing.

    Raises:
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    context.ask(_block_prompt(placement, laser_ids) if laser_ids else _free_prompt(placement))
    if context.pairs.replayed is None:
        context.bench.target.place(placement.model_copy(update={"blocked": laser_ids}))


def _block_prompt(placement: Placement, laser_ids: tuple[str, ...]) -> Prompt:
    beams = f"the beam of {laser_ids[0]}" if len(laser_ids) == 1 else f"the beams of {', '.join(laser_ids)}"
    return Prompt(
        key=f"{placement.key}/blocked-{'-'.join(laser_ids)}",
        do=f"Block {beams} with a matt black card outside the camera's view; free all other beams.",
        expect="The target shows the spots of all other lasers only, and its distance has not changed.",
        otherwise="Move the card. Do not move the target.",
        at_bench=True,
    )


def _free_prompt(placement: Placement) -> Prompt:
    return Prompt(
        key=f"{placement.key}/blocked-none",
        do="Take all cards away from the beams.",
        expect="Every spot lies on the target.",
        at_bench=True,
    )
