"""Times of the captures of a session, and its uninterrupted parts, as a drift of the image needs them.

A drift continues while the bench runs. After an interruption (a resumed or repaired session) the sensor may
have cooled or been moved, so that the image may begin anywhere. The running time therefore stands still
between two parts, and every part has an offset of its own (`model.parameters.STEP`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray


@dataclass(frozen=True)
class CaptureTimes:
    """Times of n captures in P parts of a session."""

    time: FloatArray
    """(n,) running time, -0.5 at the first capture and 0.5 at the last."""
    part: IndexArray
    """(n,) index of the part, in the order of the captures."""
    duration_s: float
    """Running time from the first capture to the last; NaN where the captures have no times: then they are
    taken to be evenly spaced."""

    @classmethod
    def of(cls, time_s: FloatArray, part_names: Sequence[str]) -> CaptureTimes:
        """Running times of captures; by their order, unless all have a time.

        Args:
            time_s: (n,) times from any zero, which may differ between parts; NaN: not stated.
            part_names: n names of parts.
        """
        names = list(dict.fromkeys(part_names))
        part = np.array([names.index(name) for name in part_names], np.intp)
        running_s = _running(time_s, part, len(names))
        duration_s = float(running_s.max(initial=0.0))
        if not duration_s > 0:  # no times, or all equal
            order = np.arange(len(part)) / max(len(part) - 1, 1)
            return cls(order - 0.5, part, float("nan"))
        return cls(running_s / duration_s - 0.5, part, duration_s)

    @property
    def limits(self) -> FloatArray:
        """(P, 2) running time at the first and at the last capture of each part."""
        own = [self.time[self.part == p] for p in range(int(self.part.max(initial=-1)) + 1)]
        return np.array([(one.min(), one.max()) for one in own]).reshape(-1, 2)


def _running(time_s: FloatArray, part: IndexArray, parts: int) -> FloatArray:
    """(n,) time since the first capture, s, without the time between parts; NaN without times."""
    running, before = np.full(len(time_s), np.nan), 0.0
    for number in range(parts):
        own = part == number
        running[own] = time_s[own] - time_s[own].min() + before
        before = running[own].max()
    return running


NO_TIMES = CaptureTimes.of(np.array([]), ())
"""Times of no captures."""
