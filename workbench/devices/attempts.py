"""Repetition of captures whose lasers were switched off too early."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from workbench.model.errors import LeaseEndedError

T = TypeVar("T")
MOST_ATTEMPTS = 3
"""A computer that stalls for the time of a lease seldom does so three times in a row."""


def within_lease(take: Callable[[], T]) -> T:
    """Result of `take`, called again where the lease of its lasers ended before its last lit frame.

    Raises:
        LeaseEndedError: it ended in every attempt.
    """
    for _ in range(MOST_ATTEMPTS - 1):
        with suppress(LeaseEndedError):
            return take()
    return take()
