"""Step `gauge_rr_trial`: every operator places the target at every standoff several times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Count, Standoff, require_different
from workbench.model.limit import Limit
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.stats import chi2_isf
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import flat_placement
from workbench.trials.trial_step import ResultLimits, TrialStepModel

LOWER_TAIL = 0.025
"""Probability below a two-sided 95 % interval."""


@dataclass(frozen=True)
class Round:
    """One operator's pass over all standoffs."""

    operator: str
    trial: int
    """Number of the operator's trial, from 1."""
    prompt: Prompt
    placements: Sequence[Placement]


class GaugeLimits(ResultLimits):
    """Limits on the result of the study; the standard deviation is decided by its 95 % interval."""

    gauge_sd_mm: Limit | None = None
    study_variation: Limit | None = None
    """Limit on GRR / total variation, without unit."""
    distinct_categories: Limit | None = None


@register
class GaugeTrialStep(TrialStepModel):
    """Separate operators from repeatability: each places the target at every standoff several times."""

    step: Literal["gauge_rr_trial"]
    standoffs_mm: Annotated[tuple[Standoff, ...], Field(min_length=2)]
    operators: Annotated[tuple[str, ...], Field(min_length=2, max_length=100)]
    trials: Annotated[int, Field(ge=2, le=100)] = 3
    """Placements of each standoff by each operator."""
    readings: Count = 1
    """Readings at one placement, of which the mean counts."""
    limits: GaugeLimits = GaugeLimits()

    @model_validator(mode="after")
    def _parts_and_operators_differ(self) -> GaugeTrialStep:
        require_different(self.standoffs_mm, "trials")
        names = [name.strip() for name in self.operators]
        if "" in names or len(set(names)) != len(names):
            raise ValueError(f"operators: expected each name once, and none blank, got {', '.join(names)}")
        return self

    @property
    def title(self) -> str:
        """Design, and the components of variance that it separates."""
        parts, operators = len(self.standoffs_mm), len(self.operators)
        error, appraisers = parts * operators * (self.trials - 1), operators - 1
        crossed = (parts - 1) * appraisers
        return (
            f"Gauge R&R, {parts} standoffs x {operators} operators x {self.trials} placements: separates"
            f" re-placements ({error} degrees of freedom), operators ({appraisers}: the upper end of GRR is"
            f" {self._widest:.2g} times its value if they dominate) and their interaction with standoffs"
            f" ({crossed})"
        )

    @property
    def _widest(self) -> float:
        """Upper end of the 95 % interval of a standard deviation between operators, over its value."""
        dof = len(self.operators) - 1
        return float(sqrt(dof / chi2_isf(1.0 - LOWER_TAIL, dof)))

    def rounds(self, name: str) -> Iterator[Round]:
        """Passes in order: every operator once, then every operator again."""
        number = 0
        for trial in range(1, self.trials + 1):
            for operator in self.operators:
                number += 1
                placements = [flat_placement(name, standoff_mm, number) for standoff_mm in self.standoffs_mm]
                yield Round(operator, trial, _round_prompt(name, number, operator, trial), placements)

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """Placements of all passes."""
        return [placement for each in self.rounds(name) for placement in each.placements]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.standoffs_mm) * len(self.operators) * self.trials * self.readings

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements, of the changes of operator, and of limits."""
        changes = [each.prompt for each in self.rounds(name)]
        return [*super().prompts(name, rig), *changes]

    def run(self, context: Context, name: str) -> str:
        """Take the readings of every pass and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a standoff has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.gauge_rr.trial import run_trial

        return run_trial(context, name, self)


def _round_prompt(name: str, number: int, operator: str, trial: int) -> Prompt:
    return Prompt(
        key=f"{name}/operator-{number:02d}",
        do=f"Operator {operator}, trial {trial}: place the target at the next standoffs yourself.",
        expect="The operator does not see earlier readings.",
        at_bench=True,
    )
