"""Signals that stop the workbench."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from workbench.cli.stopping import SIGNALS, StopAfterCapture, ignore_signals, stop_at_once
from workbench.model.errors import StoppedError


@pytest.fixture(autouse=True)
def _handlers() -> Iterator[None]:
    """The handlers of before, as they were."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_stops_at_once_and_the_next_is_ignored(number: signal.Signals) -> None:
    stop_at_once()
    with pytest.raises(StoppedError, match=number.name) as caught:
        os.kill(os.getpid(), number)
    assert caught.value.exit_code == 5
    os.kill(os.getpid(), number)


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_asks_the_second_raises_the_third_is_ignored(number: signal.Signals) -> None:
    asked = StopAfterCapture()
    assert asked.reason is None
    os.kill(os.getpid(), number)
    assert asked.reason is not None
    assert number.name in asked.reason
    with pytest.raises(StoppedError, match=number.name):
        os.kill(os.getpid(), number)
    os.kill(os.getpid(), number)


def test_ignored_signals_do_nothing() -> None:
    ignore_signals()
    for number in SIGNALS:
        os.kill(os.getpid(), number)
    assert {signal.getsignal(number) for number in SIGNALS} == {signal.SIG_IGN}
