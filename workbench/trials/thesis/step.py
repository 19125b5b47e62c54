"""Step `thesis_simulation`: range simulated scenes with the thesis's chain and the workbench's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.thesis.schema import SimulatedScene


@register
class ThesisSimulationStep(StepModel):
    """Range simulated scenes with the thesis's chain and the workbench's; the bench is not used."""

    step: Literal["thesis_simulation"]
    points: Annotated[int, Field(ge=2, le=1_000_000)]
    """Number of distances of each scene without its own number."""
    scenes: Annotated[tuple[SimulatedScene, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> ThesisSimulationStep:
        names = [scene.name for scene in self.scenes]
        if len(set(names)) != len(names):
            raise ValueError(f"scenes: expected distinct names, got {', '.join(names)}")
        return self

    @property
    def title(self) -> str:
        """Number of scenes."""
        return f"Simulate {len(self.scenes)} scenes"

    def run(self, context: Context, name: str) -> str:
        """Simulate every scene and write claims, readings and figures.

        Raises:
            BadInputError: a scene does not match the rig.
            StoppedError: a stop was requested.
        """
        # Imported here: checking a file must not import the ranger.
        from workbench.trials.thesis.trial import run_trial

        return run_trial(context, name, self.scenes, self.points)
