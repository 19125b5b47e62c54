"""The prompts that a plan may put, known before it runs: what an answers file can answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import singledispatch

from workbench.model import procedure as pr
from workbench.model.procedure import Procedure
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.prompts import captures_prompt, placement_prompt, safety_prompt
from workbench.procedure.steps import board_placement, confirmation, placement_at, question


def expected_prompts(procedures: Sequence[Procedure], rig: Rig) -> dict[str, Prompt]:
    """Every prompt that may come, by its key, in order. Of limits only what answers are possible is told."""
    found = [safety_prompt(rig)]
    for procedure in procedures:
        for index, step in enumerate(procedure.steps, start=1):
            found += _prompts(step, f"{procedure.procedure}.{index}", rig)
    return {prompt.key: prompt for prompt in found}


@singledispatch
def _prompts(step: object, name: str, rig: Rig) -> list[Prompt]:
    """Those of a step: none but for steps that say otherwise."""
    return []


@_prompts.register
def _(step: pr.ConfirmStep, name: str, rig: Rig) -> list[Prompt]:
    return [confirmation(step, name)]


@_prompts.register
def _(step: pr.AskStep, name: str, rig: Rig) -> list[Prompt]:
    return [question(step, name)]


@_prompts.register
def _(step: pr.PlaceTargetStep, name: str, rig: Rig) -> list[Prompt]:
    return _placings([placement_at(name, step.standoff_mm)])


@_prompts.register
def _(step: pr.CaptureGridStep, name: str, rig: Rig) -> list[Prompt]:
    placements = [placement_at(name, standoff_mm) for standoff_mm in step.standoffs_mm]
    about = [
        captures_prompt(f"{placement.key}/{laser_id}/{limit}", limit, placement)
        for placement in placements
        for laser_id in rig.laser_ids
        for limit in _asked_about(step.limits)
    ]
    return [*_placings(placements), *about]


@_prompts.register
def _(step: pr.CaptureBoardStep, name: str, rig: Rig) -> list[Prompt]:
    return _placings(
        [board_placement(name, number, placing, rig) for number, placing in enumerate(step.placings, start=1)]
    )


@_prompts.register
def _(step: pr.AccuracyTrialStep, name: str, rig: Rig) -> list[Prompt]:
    return _placings([placement_at(name, standoff_mm) for standoff_mm in step.standoffs_mm])


@_prompts.register
def _(step: pr.CheckLimitsStep | pr.ValidateStep, name: str, rig: Rig) -> list[Prompt]:
    return [Prompt(f"{name}/{limit}", "Go on all the same?") for limit in _asked_about(step.limits)]


def _placings(placements: Sequence[Placement]) -> list[Prompt]:
    return [placement_prompt(*pair) for pair in zip(placements, [None, *placements], strict=False)]


def _asked_about(limits: FileModel) -> Iterator[str]:
    return (name for name, limit in limits if limit is not None and limit.on_fail == "ask")
