"""Captures whose lease ended too early are taken again."""

from __future__ import annotations

import pytest

from workbench.devices.attempts import MOST_ATTEMPTS, within_lease
from workbench.model.errors import LeaseEndedError, RigNotReadyError


class Stalls:
    """Capture during which the computer stalls some times."""

    def __init__(self, times: int, error: type[Exception] = LeaseEndedError) -> None:
        self.left, self.error, self.calls = times, error, 0

    def __call__(self) -> int:
        self.calls += 1
        if self.calls <= self.left:
            raise self.error("late")
        return self.calls


@pytest.mark.parametrize("stalls", range(MOST_ATTEMPTS))
def test_a_capture_is_taken_again_until_it_is_in_time(stalls: int) -> None:
    assert within_lease(Stalls(stalls)) == stalls + 1


def test_the_last_attempt_ends_with_the_error() -> None:
    capture = Stalls(MOST_ATTEMPTS)
    with pytest.raises(LeaseEndedError):
        within_lease(capture)
    assert capture.calls == MOST_ATTEMPTS


def test_other_errors_are_not_repeated() -> None:
    capture = Stalls(1, RigNotReadyError)
    with pytest.raises(RigNotReadyError):
        within_lease(capture)
    assert capture.calls == 1
