"""Step `ask`: ask for a number or a choice and journal the answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.prompt import Prompt, Quantity
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel

ACTION_WORDS = {"redo", "skip", "abort"}
"""Words that are actions at a prompt and therefore cannot be choices."""


class NumberAsked(FileModel):
    """Number to enter."""

    unit: str
    within: Annotated[tuple[float, float], Field(alias="in")]
    usual: float | None = None

    @model_validator(mode="after")
    def _can_be_answered(self) -> NumberAsked:
        low, high = self.within
        if low > high:
            raise ValueError(f"`in`: expected [lowest, highest], got [{low:g}, {high:g}]")
        if self.usual is not None and not low <= self.usual <= high:
            raise ValueError(f"`usual`: expected {low:g} to {high:g} (`in`), got {self.usual:g}")
        return self


@register
class AskStep(StepModel):
    """Ask for a number or a choice and journal the answer."""

    step: Literal["ask"]
    text: str
    number: NumberAsked | None = None
    choices: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _asks_for_one_thing(self) -> AskStep:
        if (self.number is None) == (not self.choices):
            got = "both" if self.choices else "neither"
            raise ValueError(f"expected either `number` or `choices`, got {got}")
        if len(set(self.choices)) != len(self.choices):
            raise ValueError(f"`choices`: expected each choice once, got {', '.join(self.choices)}")
        if taken := ACTION_WORDS.intersection(choice.lower() for choice in self.choices):
            raise ValueError(
                f"`choices`: redo, skip and abort are reserved for actions, got {', '.join(sorted(taken))}"
            )
        return self

    @property
    def default_duration_s(self) -> float:
        """Time in which a person reads a value."""
        return 30.0

    @property
    def title(self) -> str:
        """Text of the question."""
        return self.text

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompt with the question."""
        return [self._prompt(name)]

    def run(self, context: Context, name: str) -> str:
        """Ask; returns the answer with its unit."""
        answer = context.ask(self._prompt(name))
        unit = "" if self.number is None else f" {self.number.unit}"
        return f"{answer.value}{unit}"

    def _prompt(self, name: str) -> Prompt:
        n = self.number
        quantity = None if n is None else Quantity(n.unit, *n.within, n.usual)
        return Prompt(name, self.text, quantity=quantity, choices=self.choices)
