"""Signals that stop the workbench, in good order."""

from __future__ import annotations

import signal
from types import FrameType

from workbench.model.errors import StoppedError

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def stop_at_once() -> None:
    """From now on a signal raises `StoppedError` wherever the program is."""
    for number in SIGNALS:
        signal.signal(number, _raise)


def ignore_signals() -> None:
    """From now on nothing stops the program: it is about to end."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


class StopAfterShot:
    """The first signal asks for a stop between two shots, the second raises, more are ignored.

    What is raised inside a library's callback may get lost there; what was asked for does not.
    """

    def __init__(self) -> None:
        self.reason: str | None = None
        """Why to stop; None while nobody asked."""
        for number in SIGNALS:
            signal.signal(number, self._ask)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        first = self.reason is None
        self.reason = f"stopped by {signal.Signals(number).name}"
        if not first:
            ignore_signals()  # what puts the lasers off must not be stopped by a third one
            raise StoppedError(self.reason)


def _raise(number: int, frame: FrameType | None) -> None:
    ignore_signals()
    raise StoppedError(f"stopped by {signal.Signals(number).name}")
