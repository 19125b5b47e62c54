"""Step `round_trial`: range a cylinder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from pydantic import model_validator

from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.trials.targets import CylinderSpec, target_placement
from workbench.trials.trial_step import ResultLimits, TrialStepModel


class RoundLimits(ResultLimits):
    """Limits on the mean errors at every range, with guard bands."""

    range_error_mm: Limit | None = None
    relative_range_error: Limit | None = None
    cylinder_error_mm: Limit | None = None
    radius_error_mm: Limit | None = None


@register
class RoundTrialStep(TrialStepModel):
    """Range a cylinder; give tables of the errors of range and radius. The prompts warn of reflections."""

    gives: ClassVar[str | None] = "readings"
    step: Literal["round_trial"]
    ranges_mm: Standoffs
    """Closest ranges over the front: of the cylinder's nearest line, if it faces the front."""
    target: CylinderSpec
    readings: Count
    limits: RoundLimits = RoundLimits()

    @model_validator(mode="after")
    def _ranges_differ(self) -> RoundTrialStep:
        require_different(self.ranges_mm, "readings")
        return self

    @property
    def title(self) -> str:
        """Diameter, and numbers of ranges and readings."""
        return (
            f"Cylinder of {self.target.diameter_mm:g} mm at {counted(len(self.ranges_mm), 'range')},"
            f" {counted(self.readings, 'reading')} each"
        )

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per range.

        Raises:
            BadInputError: the rig's lasers cannot see the cylinder.
        """
        return [
            target_placement(self.target, f"{name}/{range_mm:.12g}mm", range_mm, rig)
            for range_mm in self.ranges_mm
        ]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.ranges_mm) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a placement has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.round.trial import run_trial

        return run_trial(context, name, self, self.placements(name, context.rig))
