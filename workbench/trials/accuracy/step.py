"""Step `accuracy_trial`: range a flat target at standoffs that the fit has not used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from pydantic import model_validator

from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.number_text import counted
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import flat_placement
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.trial_step import TrialStepModel


@register
class AccuracyTrialStep(TrialStepModel):
    """Range a flat target at standoffs that the fit has not used; give a table and a chart of the errors."""

    gives: ClassVar[str | None] = "readings"
    step: Literal["accuracy_trial"]
    standoffs_mm: Standoffs
    readings: Count
    limits: AccuracyLimits = AccuracyLimits()

    @model_validator(mode="after")
    def _standoffs_differ(self) -> AccuracyTrialStep:
        require_different(self.standoffs_mm, "readings")
        return self

    @property
    def title(self) -> str:
        """Numbers of standoffs and readings."""
        where = f"Accuracy at {counted(len(self.standoffs_mm), 'standoff')}"
        return f"{where}, {counted(self.readings, 'reading')} each"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per standoff."""
        return [flat_placement(name, standoff_mm) for standoff_mm in self.standoffs_mm]

    def captures(self, rig: Rig) -> int:
        """One capture per reading; ambiguous readings take further captures of single lasers."""
        return len(self.standoffs_mm) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Take the readings at every placement and write their statistics.

        Raises:
            BadInputError: there is no calibration.
            LimitFailedError: a limit failed, or a standoff has no range.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.accuracy.trial import run_trial

        return run_trial(context, name, self.placements(name, context.rig), self.readings, self.limits)
