"""Step `repeatability_trial`: repeats at re-placements of a flat target at each standoff."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.stats import chi2_isf, chi2_sf
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import flat_placement
from workbench.trials.dither import dither_prompts
from workbench.trials.trial_step import ResultLimits, TrialStepModel

JOINT_ALARM = 0.05
"""Probability of an alarm of the error budget of all standoffs together where its sources are complete."""
MOST = 1000
"""Largest number of placements or repeats."""


class RepeatabilityLimits(ResultLimits):
    """Limits on the standard deviations at every standoff, decided by their 95 % intervals."""

    repeatability_sd_mm: Limit | None = None
    reproducibility_sd_mm: Limit | None = None


@register
class RepeatabilityTrialStep(TrialStepModel):
    """Separate the scatter of repeats from that of re-placements of a flat target."""

    step: Literal["repeatability_trial"]
    standoffs_mm: Standoffs
    placements_each: Annotated[int, Field(ge=2, le=MOST, alias="placements")] = 8
    repeats: Annotated[int, Field(ge=2, le=MOST)] = 3
    dither_mm: Annotated[float, Field(gt=0, le=100)] | None = None
    """Sideways displacement of the target between repeats, which changes the speckle; None: none."""
    limits: RepeatabilityLimits = RepeatabilityLimits()

    @model_validator(mode="after")
    def _standoffs_differ(self) -> RepeatabilityTrialStep:
        require_different(self.standoffs_mm, "placements")
        return self

    @property
    def title(self) -> str:
        """Design, and the components of variance that it separates."""
        repeats = "repeats with speckle" if self.dither_mm else "repeats"
        each = self.placements_each
        return (
            f"Repeatability, {len(self.standoffs_mm)} standoffs x {each} placements x {self.repeats} repeats:"
            f" separates {repeats} ({each * (self.repeats - 1)} degrees of freedom) and re-placements"
            f" ({each - 1}), not sessions; a source as large as all stated ones is found in"
            f" {100 * self.budget_power:.0f} %"
        )

    @property
    def budget_power(self) -> float:
        """Least probability that the budget's alarm finds a source as large as all stated ones together.

        The observed variance is then twice the stated one. If all standoffs have this ratio, chi-square
        over standoffs x (placements - 1) degrees of freedom is the most powerful test (Neyman and Pearson).
        A source of the placements alone, beside noise that the repeats average, has a larger ratio.
        """
        freedom = len(self.standoffs_mm) * (self.placements_each - 1)
        return float(chi2_sf(chi2_isf(JOINT_ALARM, freedom) / 2.0, freedom))

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """Every standoff once, then every standoff again: the target is moved between its placements."""
        return [
            flat_placement(name, standoff_mm, number)
            for number in range(1, self.placements_each + 1)
            for standoff_mm in self.standoffs_mm
        ]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.standoffs_mm) * self.placements_each * self.repeats

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements, of the displacements between repeats, and of limits."""
        moves = [
            prompt
            for placement in self.placements(name, rig)
            for prompt in dither_prompts(placement, self.repeats, self.dither_mm)
        ]
        return [*super().prompts(name, rig), *moves]

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a standoff has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.repeatability.trial import run_trial

        return run_trial(context, name, self)
