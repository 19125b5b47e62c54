"""Completeness of the accuracy trial: standoffs that were skipped, and expected ranges without a reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.model.number_text import counted
from workbench.model.target import Placement


@dataclass(frozen=True)
class LostRange:
    """Range that no reading at one placement has, although the map of spots expects it."""

    name: str
    """`closest`, `mean` or the id of a laser."""
    standoff_mm: float
    readings: int
    """Number of readings at the placement."""


@dataclass(frozen=True)
class Completeness:
    """Planned placements of a trial, and what was not measured there."""

    visited: int
    """Number of placements with readings."""
    skipped: tuple[Placement, ...] = ()
    """Placements without readings, as planned."""
    lost: tuple[LostRange, ...] = ()

    def lost_of(self, name: str) -> list[LostRange]:
        """Lost ranges of one name, in the order of the placements."""
        return [one for one in self.lost if one.name == name]

    @property
    def text(self) -> str:
        """Standoffs and ranges that were not measured, in one line; empty if all were."""
        planned = self.visited + len(self.skipped)
        standoffs = [f"{self.visited} of {counted(planned, 'standoff')}"] if self.skipped else []
        names = dict.fromkeys(one.name for one in self.lost)
        lost = [f"{name} lost at {len(self.lost_of(name))} of {self.visited}" for name in names]
        return "; ".join([*standoffs, *lost])


def lost_ranges(
    standoff_mm: float, expected: Sequence[str], found: Sequence[Sequence[str]]
) -> list[LostRange]:
    """Expected ranges that no reading at one placement has.

    Args:
        standoff_mm: standoff of the placement.
        expected: names of the expected ranges.
        found: names of the ranges of each reading.
    """
    seen = {name for names in found for name in names}
    return [LostRange(name, standoff_mm, len(found)) for name in expected if name not in seen]
