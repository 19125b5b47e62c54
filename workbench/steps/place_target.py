"""Step `place_target`: have a flat target placed for later steps that need one."""

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
    """Have a flat target placed, for steps that need one without capturing a grid."""

    gives: ClassVar[str | None] = "target"
    step: Literal["place_target"]
    standoff_mm: Standoff

    @property
    def title(self) -> str:
        """The standoff."""
        return f"Place the target at {self.standoff_mm:g} mm"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """The one placement."""
        return [flat_placement(name, self.standoff_mm)]

    def run(self, context: Context, name: str) -> str:
        """Have it placed."""
        # No exposure is set: the steps that need lit frames set their own, as one found before the latency
        # is measured may rest on old frames.
        placed = visit_placements(
            context, self.placements(name, context.rig), lambda placement: placement, lights=False
        )
        return f"at {placed[0].standoff_mm:g} mm" if placed else "left out"
