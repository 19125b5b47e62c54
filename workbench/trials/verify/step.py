"""Step `verify_trial`: check whether a calibration is still valid."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Count, Standoff, Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.rig import NonNegativeFloat, Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import flat_placement
from workbench.trials.trial_step import ResultLimits, TrialStepModel


class VerifyLimits(ResultLimits):
    """Limits on the mean error at every standoff, with guard bands."""

    error_mm: Limit | None = None
    relative_error: Limit | None = None


@register
class VerifyTrialStep(TrialStepModel):
    """Check a calibration: the lasers against each other, then ranges of a measured flat target."""

    gives: ClassVar[str | None] = "readings"
    step: Literal["verify_trial"]
    unmeasured_mm: Standoff = 600.0
    """Approximate standoff of the target for the check of the lasers against each other."""
    standoffs_mm: Annotated[Standoffs, Field(max_length=100)]
    readings: Count
    reference_sd_mm: NonNegativeFloat | None = None
    """Standard uncertainty of the standoffs; None: the rig's `placement_sd_mm`."""
    same_bench: bool = False
    """Whether ruler, rail and the target's mount are those of the calibration, unchanged since."""
    compare_with: Path | None = None
    """Another calibration of the sensor, an old or a new one, whose errors stand beside; None: none."""
    limits: VerifyLimits = VerifyLimits()

    @model_validator(mode="after")
    def _standoffs_differ(self) -> VerifyTrialStep:
        require_different(self.standoffs_mm, "readings")
        return self

    @property
    def title(self) -> str:
        """Numbers of standoffs and readings."""
        standoffs = counted(len(self.standoffs_mm), "standoff")
        where = f"Verify the calibration at {standoffs} and one unmeasured placement"
        return f"{where}, {counted(self.readings, 'reading')} each"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement that need not be measured, then one per standoff."""
        measured = [flat_placement(name, standoff_mm) for standoff_mm in self.standoffs_mm]
        known = {"standoff_sd_mm": self.reference_sd_mm}
        return [self._unmeasured(name), *(placement.model_copy(update=known) for placement in measured)]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return (1 + len(self.standoffs_mm)) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Check the lasers, take the readings, write the tables; returns the verdict.

        Raises:
            BadInputError: there is no calibration, or the one to compare with is wrong.
            LimitFailedError: the calibration is not valid, a limit failed, or a standoff has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.verify.trial import run_trial

        return run_trial(context, name, self)

    def _unmeasured(self, name: str) -> Placement:
        key = f"{name}/unmeasured-{self.unmeasured_mm:.12g}mm"
        return Placement(key=key, standoff_mm=self.unmeasured_mm, standoff_sd_mm=self.unmeasured_mm)
