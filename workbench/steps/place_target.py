"""Step `place_target`: place a flat target for later steps that need one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from workbench.model.fields import Standoff
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel, flat_placement


@register
class PlaceTargetStep(StepModel):
    """Place a flat target for later steps that need one, without captures."""

    gives: ClassVar[str | None] = "target"
    step: Literal["place_target"]
    standoff_mm: Standoff

    @property
    def title(self) -> str:
        """Standoff of the target."""
        return f"Place the target at {self.standoff_mm:g} mm"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement."""
        return [flat_placement(name, self.standoff_mm)]

    def run(self, context: Context, name: str) -> str:
        """Ask for the placement."""
        # No exposure is set here: before the latency is measured, its trial exposures could be stale frames.
        placed = visit_placements(
            context, self.placements(name, context.rig), lambda placement: placement, lights=False
        )
        return f"at {placed[0].standoff_mm:g} mm" if placed else "skipped"
