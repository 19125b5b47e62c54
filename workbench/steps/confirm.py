"""Step `confirm`: have the technician do something, and wait until it is done."""

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
    """Have the technician do something, and wait until it is done."""

    step: Literal["confirm"]
    text: str
    expect: str = ""
    """What is to be seen when it is done."""
    otherwise: str = ""
    """What to do if it is not so."""

    @property
    def default_duration_s(self) -> float:
        """A person does something."""
        return 30.0

    @property
    def title(self) -> str:
        """The text itself."""
        return self.text

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """The one question."""
        return [self._prompt(name)]

    def run(self, context: Context, name: str) -> str:
        """Ask, and wait."""
        context.ask(self._prompt(name))
        return "confirmed"

    def _prompt(self, name: str) -> Prompt:
        return Prompt(name, self.text, self.expect, self.otherwise)
