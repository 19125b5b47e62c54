"""Step `confirm`: instruct the technician and wait for a confirmation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


@register
class ConfirmStep(StepModel):
    """Instruct the technician and wait for a confirmation."""

    step: Literal["confirm"]
    text: str
    expect: str = ""
    """Expected sight afterwards."""
    otherwise: str = ""
    """Instruction for another sight than the expected one."""

    @property
    def default_duration_s(self) -> float:
        """Time in which a person does something."""
        return 30.0

    @property
    def title(self) -> str:
        """Text of the instruction."""
        return self.text

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompt with the instruction."""
        return [self._prompt(name)]

    def run(self, context: Context, name: str) -> str:
        """Show the prompt and wait."""
        context.ask(self._prompt(name))
        return "confirmed"

    def _prompt(self, name: str) -> Prompt:
        return Prompt(name, self.text, self.expect, self.otherwise)
