"""Simulated time of the virtual bench.

Captures after a stop have the same times as without it, and so has the fit of a drift the same result. Time
advances with every frame of the stream and stands still while the bench is closed. Each placement begins a
fixed time after the last capture that counts: captures that are set aside take no time.
"""

from __future__ import annotations

PLACING_NS = 20_000_000_000
"""Time to place the target and to answer the prompt."""
SETTLING_NS = 100_000_000
"""Time to switch the lasers before each capture."""
FRAME_NS = 33_333_333
"""Frame period of the camera; a longer exposure takes its own time."""


class SimulatedClock:
    """Clock of the virtual bench, see `workbench.devices.protocols.Clock`. It begins at 0."""

    def __init__(self) -> None:
        self._now_ns = 0
        self._switched_ns: int | None = None
        """Time after the last switching for this placement; None: there was none."""

    def now_ns(self) -> int:
        """Present time."""
        return self._now_ns

    def continue_after(self, time_ns: int) -> None:
        """Place the target after the last capture that counts."""
        self._now_ns, self._switched_ns = time_ns + PLACING_NS, None

    def switch(self, again: bool = False) -> None:
        """Let the lasers settle before a capture; `again`: before the same one, which takes its time once."""
        if not again or self._switched_ns is None:
            self._switched_ns = self._now_ns + SETTLING_NS
        self._now_ns = self._switched_ns

    def expose(self, exposure_s: float) -> None:
        """Advance by one frame."""
        self._now_ns += max(FRAME_NS, round(exposure_s * 1e9))
