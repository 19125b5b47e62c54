"""Progress of a replay: captures read from disk so far, and the time left at the pace measured."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType

from workbench.model import event as ev

NONE_KEPT: Mapping[str, int] = MappingProxyType({})
"""No placement is read from disk."""


class ReplayProgress:
    """Counts the captures of kept placements as a replay reads them."""

    def __init__(self, kept: Mapping[str, int], clock_s: Callable[[], float] = time.monotonic) -> None:
        """Progress before the first capture.

        Args:
            kept: numbers of captures of the placements that are not captured again, by key.
            clock_s: monotonic time, s.
        """
        self._kept, self._clock_s = dict(kept), clock_s
        self._read: Counter[str] = Counter()
        """Captures read so far, by the key of their placement."""
        self._last_s: float | None = None
        """Time of the last capture, if it was read from disk; prompts and new captures are not counted."""
        self._elapsed_s = 0.0
        self._intervals = 0

    def keeps(self, key: str) -> bool:
        """Whether the captures of a placement are read from disk."""
        return key in self._kept

    def take(self, record: ev.Record) -> None:
        """Update the progress with a record."""
        match record.event:
            case ev.CaptureTaken(placement_key=key) if key in self._kept:
                now_s = self._clock_s()
                if self._last_s is not None:
                    self._elapsed_s += now_s - self._last_s
                    self._intervals += 1
                self._last_s = now_s
                self._read[key] += 1
            case ev.CaptureTaken():
                self._last_s = None
            case ev.SetAside(key=key):
                self._kept.pop(key, None)
                self._read.pop(key, None)
            case _:
                pass

    @property
    def done(self) -> int:
        """Number of captures read so far."""
        return self._read.total()

    @property
    def total(self) -> int:
        """Number of captures to read."""
        return sum(self._kept.values())

    @property
    def seconds_left(self) -> float | None:
        """Estimated time for the other captures, without that of a person; None before the second capture."""
        if not self._intervals:
            return None
        return (self.total - self.done) * self._elapsed_s / self._intervals
