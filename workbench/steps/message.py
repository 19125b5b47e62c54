"""Step `message`: show a text."""

from __future__ import annotations

from typing import Literal

from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


@register
class MessageStep(StepModel):
    """Show a text to the technician."""

    step: Literal["message"]
    text: str

    @property
    def default_duration_s(self) -> float:
        """Zero: the text is shown without waiting."""
        return 0.0

    @property
    def title(self) -> str:
        """Text of the message."""
        return self.text

    def run(self, context: Context, name: str) -> str:
        """Return at once: the terminal shows the title when the step begins."""
        return "shown"
