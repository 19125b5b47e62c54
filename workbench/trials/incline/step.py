"""Step `incline_trial`: range a flat target that is turned by set angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.trials.incline.set_up import SetUp
from workbench.trials.targets import InclineSpec, target_placement
from workbench.trials.trial_step import ResultLimits, TrialStepModel


class InclineLimits(ResultLimits):
    """Limits on the mean errors at every set-up, with guard bands."""

    range_error_mm: Limit | None = None
    relative_range_error: Limit | None = None
    angle_error_deg: Limit | None = None


@register
class InclineTrialStep(TrialStepModel):
    """Range a flat target turned by set angles; give the errors of range, angle, and angle differences."""

    gives: ClassVar[str | None] = "readings"
    step: Literal["incline_trial"]
    ranges_mm: Standoffs
    """Closest ranges over the front, at which the near end of the target is placed."""
    targets: Annotated[tuple[InclineSpec, ...], Field(min_length=1)]
    readings: Count
    same_bench: bool = False
    """Whether the target turns on the mount of the calibration, whose common tilt is then measured."""
    limits: InclineLimits = InclineLimits()

    @model_validator(mode="after")
    def _placements_differ(self) -> InclineTrialStep:
        require_different(self.ranges_mm, "readings")
        turns = [(target.axis, target.angle_deg) for target in self.targets]
        if len(set(turns)) != len(turns):
            raise ValueError("targets: expected each angle once; for more readings raise `readings`")
        return self

    @property
    def title(self) -> str:
        """Angles, and numbers of ranges and readings."""
        angles = ", ".join(f"{target.angle_deg:g}" for target in self.targets)
        where = f"Incline of {angles} deg at {counted(len(self.ranges_mm), 'range')}"
        return f"{where}, {counted(self.readings, 'reading')} each"

    def set_ups(self, name: str, rig: Rig) -> list[SetUp]:
        """Every set-up, one angle after the other.

        Raises:
            BadInputError: the rig's lasers cannot see a target.
        """
        found = []
        for target in self.targets:
            for range_mm in self.ranges_mm:
                key = f"{name}/{target.axis[0]}{target.angle_deg:.12g}deg-{range_mm:.12g}mm"
                found.append(SetUp(target, range_mm, target_placement(target, key, range_mm, rig)))
        return found

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement for each angle and range; raises the errors of `set_ups`."""
        return [set_up.placement for set_up in self.set_ups(name, rig)]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.targets) * len(self.ranges_mm) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a set-up has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.incline.trial import run_trial

        return run_trial(context, name, self)
