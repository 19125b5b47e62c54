"""Figures of a proof, tested against the bounds of the specification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, norm

Bounds = tuple[float, float]
SIGNIFICANCE = 0.05
"""Probability that a figure exactly at its bound is called missed."""


@dataclass(frozen=True)
class KnownMiss:
    """Figure that does not reach the specification, with the reason and the bounds that it keeps."""

    reason: str
    bounds: Bounds


@dataclass(frozen=True)
class Figure:
    """One figure of the proof with the bounds of the specification."""

    trial: str
    quantity: str
    value: float
    """Share of the runs, or a mean over the runs if `sd` is given."""
    bounds: Bounds | None
    """None: the figure is information, not a claim."""
    runs: int
    sd: float | None = None
    """Standard deviation between runs of a mean."""
    known: KnownMiss | None = None

    @property
    def is_missed(self) -> bool:
        """Whether the runs contradict the specification (5 %, one-sided)."""
        return self.bounds is not None and self._contradicts(self.bounds)

    @property
    def is_unjustified(self) -> bool:
        """Whether the figure is missed, and not as its known states."""
        return self.is_missed and (self.known is None or self._contradicts(self.known.bounds))

    def _contradicts(self, bounds: Bounds) -> bool:
        low, high = bounds
        if low <= self.value <= high:
            return False
        bound = high if self.value > high else low
        if self.sd is not None:
            return bool(norm.sf(abs(self.value - bound) * self.runs**0.5 / self.sd) < SIGNIFICANCE)
        count = self.value * self.runs
        if self.value > high:
            return bool(binom.sf(np.floor(count) - 1, self.runs, high) < SIGNIFICANCE)
        return bool(binom.cdf(np.ceil(count), self.runs, low) < SIGNIFICANCE)

    def line(self) -> str:
        """A line of the table."""
        expected = "-" if self.bounds is None else f"{self.bounds[0]:g} to {self.bounds[1]:g}"
        missed = "  MISSED" if self.is_missed else ""
        if self.is_missed and self.known is not None and not self.is_unjustified:
            missed += f": {self.known.reason}"
        return f"{self.trial:<14}{self.quantity:<88}{self.value:>8.3f}  {expected} ({self.runs}){missed}"
