"""Prompts of a procedure to the operator of the bench, and their answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from workbench.model.text_length import length_error
from workbench.model.yamlfile import FileModel

Action = Literal["done", "redo", "skip", "abort"]
"""`redo` captures a placement again, `skip` skips one; `Prompt.may` states which placement."""
By = Literal["person", "answers file", "emulator"]


@dataclass(frozen=True)
class Quantity:
    """Number to enter, between `low` and `high`; `usual` is the default."""

    unit: str
    low: float
    high: float
    usual: float | None = None


@dataclass(frozen=True)
class Prompt:
    """One instruction or question."""

    key: str
    """Name in answers files and in the journal."""
    do: str
    """Instruction or question."""
    expect: str = ""
    """Expected sight afterwards."""
    otherwise: str = ""
    """Instruction for another sight than the expected one."""
    quantity: Quantity | None = None
    choices: tuple[str, ...] = ()
    yes: str = ""
    """Effect of a confirmation, where it is not obvious."""
    at_bench: bool = False
    """Whether the answer needs a person who sees the bench: on a real rig an answers file cannot give it."""
    may: Mapping[Action, str] = field(default_factory=dict)
    """Further actions besides `done` and `abort`, with a short description of their effect here."""
    overrules: bool = False
    """Whether a confirmation keeps results in spite of a failed check; the certificate then shows it."""

    def refuse(self, answer: Answer) -> str | None:
        """Reason why an answer is not valid; None for a valid one."""
        if wrong := length_error(answer.reason or ""):
            return f"reason: {wrong}"
        if answer.action != "done":
            if answer.action != "abort" and answer.action not in self.may:
                return f"expected an answer, got {answer.action}, which is not possible here"
            return None if answer.reason else f"expected a reason with {answer.action}: it discards data"
        if self.quantity is not None:
            return self._refuse_number(self.quantity, answer.value)
        if self.choices:
            wrong = f"expected one of {', '.join(self.choices)}, got {answer.value or 'nothing'}"
            return None if answer.value in self.choices else wrong
        return None if answer.value is None else f"expected yes, got {answer.value or 'nothing'}"

    def _refuse_number(self, quantity: Quantity, value: float | str | None) -> str | None:
        if isinstance(value, float) and quantity.low <= value <= quantity.high:
            return None
        return f"expected {quantity.low:g} to {quantity.high:g} {quantity.unit}, got {value}"


class Answer(FileModel):
    """Answer of an operator to a prompt."""

    action: Action = "done"
    value: Annotated[float, Field(strict=True)] | str | None = None
    """Number or choice, if the prompt asks for one."""
    reason: str | None = None
    by: By = "person"
