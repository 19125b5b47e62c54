"""Questions that a procedure puts to whoever operates the bench, and their answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from workbench.model.yamlfile import FileModel

Action = Literal["done", "redo", "skip", "abort"]
"""`redo` has a placement captured again, `skip` leaves one out; a prompt says which (`Prompt.may`)."""
By = Literal["person", "answers file", "emulator"]


@dataclass(frozen=True)
class Quantity:
    """A number to be read off: within `low` and `high`; `usual` is what it should be."""

    unit: str
    low: float
    high: float
    usual: float | None = None


@dataclass(frozen=True)
class Prompt:
    """One question."""

    key: str
    """Names it in answers files and in the journal."""
    do: str
    expect: str = ""
    """What is to be seen when it is done."""
    otherwise: str = ""
    """What to do if it is not so."""
    quantity: Quantity | None = None
    choices: tuple[str, ...] = ()
    yes: str = ""
    """What confirming does, where it is not plain."""
    at_bench: bool = False
    """Only somebody who sees the bench can answer: on a real rig no file does."""
    may: Mapping[Action, str] = field(default_factory=dict)
    """What is possible besides `done` and `abort`, and what each does here, in a few words."""

    def refuse(self, answer: Answer) -> str | None:
        """What is wrong with an answer; None where it fits."""
        if answer.action != "done":
            if answer.action != "abort" and answer.action not in self.may:
                return f"expected an answer, got {answer.action}, which is not possible here"
            return None if answer.reason else f"{answer.action} loses data: expected a reason with it"
        if self.quantity is not None:
            return self._refuse_number(self.quantity, answer.value)
        if self.choices:
            wrong = f"expected one of {', '.join(self.choices)}, got {answer.value}"
            return None if answer.value in self.choices else wrong
        return None if answer.value is None else f"expected yes, got {answer.value or 'nothing'}"

    def _refuse_number(self, quantity: Quantity, value: float | str | None) -> str | None:
        if isinstance(value, float) and quantity.low <= value <= quantity.high:
            return None
        return f"expected {quantity.low:g} to {quantity.high:g} {quantity.unit}, got {value}"


class Answer(FileModel):
    """What the operator says."""

    action: Action = "done"
    value: Annotated[float, Field(strict=True)] | str | None = None
    """A number or a choice, where one was asked for."""
    reason: str | None = None
    by: By = "person"
