"""Step `missing_spots_trial`: range a target with all lasers, and with some left off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.errors import BadInputError
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.targets import FlatTargetSpec, TargetSpec, target_placement


@register
class MissingSpotsTrialStep(StepModel):
    """Range a target with all lasers, and with some left off; compare the errors of the range."""

    needs: ClassVar[str | None] = "calibration"
    gives: ClassVar[str | None] = "readings"
    step: Literal["missing_spots_trial"]
    ranges_mm: Standoffs
    """Closest ranges over the front."""
    missing: Annotated[tuple[Count, ...], Field(min_length=1)]
    """Numbers of lasers left off; which ones, changes from reading to reading."""
    readings: Count
    """Number of readings with all lasers, and with each number of lasers left off."""
    target: TargetSpec = FlatTargetSpec()

    @model_validator(mode="after")
    def _set_ups_differ(self) -> MissingSpotsTrialStep:
        require_different(self.ranges_mm, "readings")
        if len(set(self.missing)) != len(self.missing):
            raise ValueError(f"missing: expected each number once, got {list(self.missing)}")
        return self

    @property
    def title(self) -> str:
        """Numbers of lasers left off, of ranges and readings."""
        numbers = ", ".join(map(str, self.missing))
        return f"{numbers} lasers off at {len(self.ranges_mm)} ranges, {self.readings} readings each"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per range.

        Raises:
            BadInputError: no laser would be on, or the rig's lasers cannot see the target.
        """
        if max(self.missing) >= len(rig.lasers):
            raise BadInputError(
                f"{name}: missing: expected at most {len(rig.lasers) - 1} of the rig's {len(rig.lasers)}"
                f" lasers, got {max(self.missing)}"
            )
        return [
            target_placement(self.target, f"{name}/{range_mm:.12g}mm", range_mm, rig)
            for range_mm in self.ranges_mm
        ]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.ranges_mm) * (1 + len(self.missing)) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.missing_spots.trial import run_trial

        placements = self.placements(name, context.rig)
        return run_trial(context, name, self.target, placements, (0, *self.missing), self.readings)
