"""Handling of the signals that stop the workbench."""

from __future__ import annotations

import signal
from types import FrameType

from workbench.model.errors import StoppedError

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
BY_CTRL_C = f"stopped by {signal.SIGINT.name}"
"""Reason of a stop by Ctrl-C."""


def stop_at_once() -> None:
    """Make signals raise `StoppedError` immediately."""
    for number in SIGNALS:
        signal.signal(number, _raise)


def ignore_signals() -> None:
    """Ignore further signals while the program ends."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


class StopAfterCapture:
    """Stop requests: the first signal stops between two captures, the second at once; others are ignored.

    An exception may be lost in a library's callback; the request of the first signal is not.
    """

    def __init__(self) -> None:
        self.reason: str | None = None
        """Reason to stop; None without a request."""
        for number in SIGNALS:
            signal.signal(number, self._request)

    def _request(self, number: int, frame: FrameType | None) -> None:
        first = self.reason is None
        self.reason = f"stopped by {signal.Signals(number).name}"
        if not first:
            ignore_signals()  # a third signal must not interrupt switching the lasers off
            raise StoppedError(self.reason)


def _raise(number: int, frame: FrameType | None) -> None:
    ignore_signals()
    raise StoppedError(f"stopped by {signal.Signals(number).name}")
