"""Step `ask`: ask for a number or for one of some choices; the answer is kept in the journal."""

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
"""Typed at a prompt these are actions, and choose nothing."""


class NumberAsked(FileModel):
    """A number to be read off."""

    unit: str
    within: Annotated[tuple[float, float], Field(alias="in")]
    usual: float | None = None

    @model_validator(mode="after")
    def _can_be_answered(self) -> NumberAsked:
        low, high = self.within
        if low > high:
            raise ValueError(f"`in`: expected [lowest, highest], got [{low:g}, {high:g}]")
        if self.usual is not None and not low <= self.usual <= high:
            raise ValueError(f"`usual`: expected {low:g} to {high:g}, as `in` says, got {self.usual:g}")
        return self


@register
class AskStep(StepModel):
    """Ask for a number or for one of some choices; the answer is kept in the journal."""

    step: Literal["ask"]
    text: str
    number: NumberAsked | None = None
    choices: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _asks_for_one_thing(self) -> AskStep:
        if (self.number is None) == (not self.choices):
            raise ValueError("expected either `number` or `choices`")
        if len(set(self.choices)) != len(self.choices):
            raise ValueError(f"`choices`: expected each once, got {', '.join(self.choices)}")
        if taken := ACTION_WORDS.intersection(choice.lower() for choice in self.choices):
            raise ValueError(
                f"`choices`: expected other words than redo, skip, abort, got {', '.join(taken)}"
            )
        return self

    @property
    def default_duration_s(self) -> float:
        """A person reads something off."""
        return 30.0

    @property
    def title(self) -> str:
        """The question itself."""
        return self.text

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """The one question."""
        return [self._prompt(name)]

    def run(self, context: Context, name: str) -> str:
        """Ask; the outcome is the answer with its unit."""
        answer = context.ask(self._prompt(name))
        unit = "" if self.number is None else f" {self.number.unit}"
        return f"{answer.value}{unit}"

    def _prompt(self, name: str) -> Prompt:
        n = self.number
        quantity = None if n is None else Quantity(n.unit, *n.within, n.usual)
        return Prompt(name, self.text, quantity=quantity, choices=self.choices)
