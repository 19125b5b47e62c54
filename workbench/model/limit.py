"""Limit on one measured quantity, inline in a procedure file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.yamlfile import FileModel

Verdict = Literal["pass", "marginal", "fail"]
Bounds = tuple[float | None, float | None]
"""Lowest and highest value; `null`: no bound."""


class Limit(FileModel):
    """Limit `in: [lo, hi]`, ends included; values outside `marginal` but inside `in` get a remark."""

    within: Annotated[Bounds, Field(alias="in")]
    marginal: Bounds | None = None
    """Bounds of values without a remark; the procedure continues after a remark."""
    on_fail: Literal["retry", "ask", "stop"] = "stop"

    @model_validator(mode="after")
    def _bounds_are_in_order(self) -> Limit:
        for name, (low, high) in {"in": self.within, "marginal": self.marginal or (None, None)}.items():
            if low is not None and high is not None and low > high:
                raise ValueError(f"`{name}`: expected [lowest, highest], got [{low:g}, {high:g}]")
        if self.within == (None, None):
            raise ValueError("`in`: expected at least one number; [null, null] cannot fail")
        if self.marginal is not None and not all(
            _holds(self.within, end) for end in self.marginal if end is not None
        ):
            raise ValueError(f"`marginal` {list(self.marginal)} must lie inside `in` {list(self.within)}")
        return self

    def judge(self, value: float | None) -> Verdict:
        """Verdict on a value; None (not measured) fails."""
        if value is None or not _holds(self.within, value):
            return "fail"
        return "pass" if self.marginal is None or _holds(self.marginal, value) else "marginal"

    def describe(self) -> str:
        """Limit in words, for messages."""
        low, high = self.within
        if low is None:
            return f"at most {high:g}"
        return f"at least {low:g}" if high is None else f"{low:g} to {high:g}"


def _holds(bounds: Bounds, value: float) -> bool:
    low, high = bounds
    return (low is None or low <= value) and (high is None or value <= high)
