"""Operator of the virtual bench, which answers every prompt immediately with the expected value."""

from __future__ import annotations

from workbench.model.prompt import Answer, Prompt


class EmulatedOperator:
    """Operator that confirms, or answers with the default, the middle of an interval or the first choice."""

    def ask(self, prompt: Prompt) -> Answer:
        """Answer immediately."""
        value: float | str | None = prompt.choices[0] if prompt.choices else None
        if (quantity := prompt.quantity) is not None:
            middle = (quantity.low + quantity.high) / 2
            value = middle if quantity.usual is None else quantity.usual
        return Answer(value=value, by="emulator")
