"""The operator of the virtual bench: does at once what a prompt asks for, and reads what he should."""

from __future__ import annotations

from workbench.model.prompt import Answer, Prompt


class EmulatedOperator:
    """Says that all is as it should be; where the usual is not known, the middle or the first choice."""

    def ask(self, prompt: Prompt) -> Answer:
        """Answer at once."""
        value: float | str | None = prompt.choices[0] if prompt.choices else None
        if (quantity := prompt.quantity) is not None:
            middle = (quantity.low + quantity.high) / 2
            value = middle if quantity.usual is None else quantity.usual
        return Answer(value=value, by="emulator")
