"""Bounds of the numbers in a file from a user, each with its reason.

Beyond them a number is a slip (another unit, a lost decimal point), and the arithmetic overflows.
"""

from __future__ import annotations

from typing import Protocol, TypeVar

from pydantic import AfterValidator

from workbench.model.problems import short

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


def within(low: float, high: float, why: str) -> AfterValidator:
    """Validator of a number from `low` to `high`, both included.

    Args:
        low: smallest accepted number.
        high: largest accepted number.
        why: what lies beyond, for the message.
    """

    def check(number: Number) -> Number:
        if not low <= number <= high:
            raise ValueError(f"expected {low:g} to {high:g}, got {short(number)} ({why})")
        return number

    return AfterValidator(check)


def prior_within(low: float, high: float, most_sd: float, why: str) -> AfterValidator:
    """Validator of a prior whose mean lies from `low` to `high` and whose sd is at most `most_sd`."""

    def check(prior: PriorLike) -> PriorLike:
        if not low <= prior.value <= high:
            raise ValueError(f"expected a value of {low:g} to {high:g}, got {prior.value:g} ({why})")
        if prior.sd > most_sd:
            raise ValueError(f"expected an sd of at most {most_sd:g}, got {prior.sd:g} ({why})")
        return prior

    return AfterValidator(check)
