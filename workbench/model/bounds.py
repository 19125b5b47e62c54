"""Bounds of the numbers in a file from a user, each with its reason.

Beyond them a number is a slip (another unit, a lost decimal point), and the arithmetic overflows.
"""

from __future__ import annotations

from typing import Protocol, TypeVar

from pydantic import AfterValidator, ValidationInfo

from workbench.model.problems import short

RECORDED = "recorded"
"""Context of the validation of a file in a session: it was accepted by the bounds of its time."""
Number = TypeVar("Number", int, float)


class HasMeanAndSd(Protocol):
    """A prior."""

    @property
    def value(self) -> float:
        """Mean."""

    @property
    def sd(self) -> float:
        """Standard deviation."""


PriorLike = TypeVar("PriorLike", bound=HasMeanAndSd)


def applies(info: ValidationInfo) -> bool:
    """Whether bounds are checked: not in files that a session has recorded."""
    return not (isinstance(info.context, str) and info.context == RECORDED)


def within(low: float, high: float, why: str) -> AfterValidator:
    """Validator of a number from `low` to `high`, both included.

    Args:
        low: smallest accepted number.
        high: largest accepted number.
        why: what lies beyond, for the message.
    """

    def check(number: Number, info: ValidationInfo) -> Number:
        if applies(info) and not low <= number <= high:
            raise ValueError(f"expected {low:g} to {high:g}, got {short(number)} ({why})")
        return number

    return AfterValidator(check)


def prior_within(low: float, high: float, most_sd: float, why: str) -> AfterValidator:
    """Validator of a prior whose mean lies from `low` to `high` and whose sd is at most `most_sd`."""

    def check(prior: PriorLike, info: ValidationInfo) -> PriorLike:
        if not applies(info):
            return prior
        if not low <= prior.value <= high:
            raise ValueError(f"expected a value of {low:g} to {high:g}, got {prior.value:g} ({why})")
        if prior.sd > most_sd:
            raise ValueError(f"expected an sd of at most {most_sd:g}, got {prior.sd:g} ({why})")
        return prior

    return AfterValidator(check)
