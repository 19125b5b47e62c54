"""Step `thesis_simulation`: range simulated scenes as the thesis did and as the workbench does."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.thesis.schema import SimulatedScene


@register
class ThesisSimulationStep(StepModel):
    """Range simulated scenes as the thesis did and as the workbench does; no camera takes part."""

    step: Literal["thesis_simulation"]
    points: Annotated[int, Field(ge=2, le=1_000_000)]
    """Distances of each scene that does not state its own number."""
    scenes: Annotated[tuple[SimulatedScene, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> ThesisSimulationStep:
        names = [scene.name for scene in self.scenes]
        if len(set(names)) != len(names):
            raise ValueError(f"names of scenes must differ, got {names}")
        return self

    @property
    def title(self) -> str:
        """How much is simulated."""
        return f"Simulate {len(self.scenes)} scenes"

    def run(self, context: Context, name: str) -> str:
        """Simulate every scene, and write claims, readings and figures.

        Raises:
            BadInputError: a scene and the rig do not go together.
            StoppedError: a stop was asked for.
        """
        # Imported here: a file is checked without the ranger.
        from workbench.trials.thesis.trial import run_trial

        return run_trial(context, name, self.scenes, self.points)
