"""Base class of the steps of trials: limits on the results, and the prompts that every trial may show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from pydantic import model_validator

from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.limits import refuse_retry, result_limit_prompts
from workbench.procedure.engine.step import StepModel


class ResultLimits(FileModel):
    """Base class of limits on the results of a trial, which would be the same after a retry."""

    _no_retry = model_validator(mode="after")(refuse_retry)


class TrialStepModel(StepModel):
    """Base class of trials: they need a calibration, and have limits on their results."""

    needs: ClassVar[str | None] = "calibration"
    limits: ResultLimits = ResultLimits()

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements, of readings outside their intervals, and of limits."""
        placements = self.placements(name, rig)
        return [
            *super().prompts(name, rig),
            *(
                outside_prompt(placement, "Readings lie outside their 95 % interval")
                for placement in placements
            ),
            *result_limit_prompts(name, self.limits),
        ]


def outside_prompt(placement: Placement, found: str) -> Prompt:
    """Question about readings outside their 95 % interval.

    Args:
        placement: placement of the readings.
        found: description of the readings.
    """
    here = f"{placement.standoff_mm:g} mm"
    return Prompt(
        key=f"{placement.key}/outside",
        do=f"{found}. Keep the readings at {here}?",
        expect="1 of 20 readings lies outside without a cause. The target is the one of the prompt.",
        otherwise="Remove the cause, then `redo`. The reason is shown in the result.",
        yes="keep them",
        overrules=True,
        may={"redo": f"{here} again", "skip": f"leave {here} out"},
    )
