"""Step `measure_latency`: count the frames between switching a laser on and its first full exposure."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from workbench.model.number_text import counted
from workbench.procedure.capture.automatic import AutomaticControl
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


@register
class MeasureLatencyStep(StepModel):
    """Measure the camera's latency in frames; that many are discarded before each later capture.

    Automatic exposure, gain or white balance that the camera does not switch off is reported.
    """

    needs: ClassVar[str | None] = "target"
    step: Literal["measure_latency"]
    most_frames: Annotated[int, Field(ge=0, le=50)] = 20

    @property
    def title(self) -> str:
        """Description of the step."""
        return "Measure the camera's latency"

    def run(self, context: Context, name: str) -> str:
        """Measure the latency and set the camera to discard as many frames."""
        measured = context.measure_latency(name, self.most_frames)
        outcome = f"{counted(measured.frames, 'frame')}, discarded before each capture"
        remark = AutomaticControl(measured.darkening, measured.dimming).text
        return f"{outcome}. {remark}" if remark else outcome
