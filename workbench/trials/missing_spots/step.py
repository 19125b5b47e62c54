"""Step `missing_spots_trial`: range a target with all lasers, and with some left off or blocked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from pydantic import model_validator

from workbench.model.errors import BadInputError
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.trials.missing_spots.sets import ALL, Condition, block_prompts
from workbench.trials.targets import FlatTargetSpec, TargetSpec, target_placement
from workbench.trials.trial_step import ResultLimits, TrialStepModel


class MissingSpotsLimits(ResultLimits):
    """Limits on the errors, with guard bands, and on the summary of each number of missing spots."""

    range_error_mm: Limit | None = None
    relative_range_error: Limit | None = None
    ratio: Limit | None = None
    """Limit on the mean absolute error relative to that of all lasers."""
    coverage: Limit | None = None
    lost: Limit | None = None
    """Limit on the share of readings without a range."""


@register
class MissingSpotsTrialStep(TrialStepModel):
    """Range a target with all lasers, and with some left off or blocked; compare the errors of the range."""

    gives: ClassVar[str | None] = "readings"
    step: Literal["missing_spots_trial"]
    ranges_mm: Standoffs
    """Closest ranges over the front."""
    missing: tuple[Count, ...] = ()
    """Numbers of lasers left off; which ones, changes from reading to reading."""
    blocked: tuple[Count, ...] = ()
    """Numbers of beams blocked before the target; a prompt names the lasers."""
    readings: Count
    """Number of readings with all lasers, and with each number of missing spots."""
    target: TargetSpec = FlatTargetSpec()
    limits: MissingSpotsLimits = MissingSpotsLimits()

    @model_validator(mode="after")
    def _set_ups_differ(self) -> MissingSpotsTrialStep:
        require_different(self.ranges_mm, "readings")
        for key, numbers in {"missing": self.missing, "blocked": self.blocked}.items():
            if len(set(numbers)) != len(numbers):
                raise ValueError(f"{key}: expected each number once, got {list(numbers)}")
        if not self.missing and not self.blocked:
            raise ValueError("missing, blocked: expected a number of lasers in one of them, got none")
        return self

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All lasers, then each number of lasers left off and of blocked beams."""
        return (
            ALL,
            *(Condition(number, "off") for number in self.missing),
            *(Condition(number, "blocked") for number in self.blocked),
        )

    @property
    def title(self) -> str:
        """Numbers of lasers left off and blocked, of ranges and readings."""
        names = ", ".join(one.name for one in self.conditions[1:])
        where = f"Lasers {names} at {counted(len(self.ranges_mm), 'range')}"
        return f"{where}, {counted(self.readings, 'reading')} each"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per range.

        Raises:
            BadInputError: no laser would be on, beams of one emitter are to be left off, or the rig's lasers
                cannot see the target.
        """
        for key, numbers in {"missing": self.missing, "blocked": self.blocked}.items():
            if max(numbers, default=0) >= len(rig.lasers):
                raise BadInputError(
                    f"{name}: {key}: expected at most {len(rig.lasers) - 1} of the rig's {len(rig.lasers)}"
                    f" lasers, got {max(numbers)}"
                )
        if self.missing and any(len(group) > 1 for group in rig.emitters):
            raise BadInputError(
                f"{name}: missing: expected lasers that are switched one by one, got beams of one emitter;"
                " block them instead (blocked)"
            )
        return [
            target_placement(self.target, f"{name}/{range_mm:.12g}mm", range_mm, rig)
            for range_mm in self.ranges_mm
        ]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.ranges_mm) * len(self.conditions) * self.readings

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements, of the blocked beams, and of limits."""
        blocks = [
            prompt
            for placement in self.placements(name, rig)
            for prompt in block_prompts(placement, rig.laser_ids, self.blocked, self.readings)
        ]
        return [*super().prompts(name, rig), *blocks]

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a placement has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.missing_spots.trial import run_trial

        return run_trial(context, name, self, self.placements(name, context.rig))
