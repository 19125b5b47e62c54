"""Step `warm_up`: run the camera with the lasers off until its focal length is stable."""

from __future__ import annotations

from typing import Literal

from workbench.model.fields import Count
from workbench.model.number_text import counted
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel

SECONDS_PER_FRAME = 0.1
"""Default duration per frame: 30 frames per second, two of three discarded as stale."""


@register
class WarmUpStep(StepModel):
    """Run the camera for a number of frames with the lasers off."""

    step: Literal["warm_up"]
    frames: Count

    @property
    def title(self) -> str:
        """Number of frames."""
        return f"Warm up for {counted(self.frames, 'frame')}"

    @property
    def default_duration_s(self) -> float:
        """Time of the frames."""
        return SECONDS_PER_FRAME * self.frames

    def run(self, context: Context, name: str) -> str:
        """Grab the frames."""
        context.warm_up(name, self.frames)
        return counted(self.frames, "frame")
