"""Statistics of the missing-spots trial: errors with lasers left off, relative to those of all lasers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from workbench.model.event import ReadingTaken
from workbench.trials.statistics.coverage import clopper_pearson


@dataclass(frozen=True)
class MissingSummary:
    """Errors of all readings with one number of lasers left off."""

    left_off: int
    readings: int
    """Number of readings with a range."""
    without_range: int
    mean_absolute_relative_error: float | None
    ratio: float | None
    """`mean_absolute_relative_error` / that of all lasers, over the placements with ranges of both."""
    coverage: float | None
    """Share of readings whose 95 % interval contains the true range."""
    coverage_low: float | None
    coverage_high: float | None
    """95 % interval of `coverage` (Clopper-Pearson). It counts placements, as the readings of one share its
    error."""


def missing_summary(
    left_off: int, taken: Sequence[Sequence[ReadingTaken]], full: Sequence[Sequence[ReadingTaken]]
) -> MissingSummary:
    """Summary of readings with `left_off` lasers off.

    Args:
        left_off: number of lasers left off.
        taken: readings at each placement.
        full: readings of all lasers at the same placements.
    """
    readings = [reading for of in taken for reading in of]
    pairs = [(_mean_error(own), _mean_error(whole)) for own, whole in zip(taken, full, strict=True)]
    both = [(own, whole) for own, whole in pairs if own is not None and whole is not None]
    relative = [one for one in map(_relative_error, readings) if one is not None]
    shares = [share for of in taken if (share := _share_inside(of)) is not None]
    low, high = clopper_pearson(sum(shares), len(shares)) if shares else (None, None)
    return MissingSummary(
        left_off,
        len(relative),
        len(readings) - len(relative),
        fmean(relative) if relative else None,
        fmean(own for own, _ in both) / fmean(whole for _, whole in both) if both else None,
        fmean(shares) if shares else None,
        low,
        high,
    )


def _relative_error(reading: ReadingTaken) -> float | None:
    return None if reading.error_mm is None else abs(reading.error_mm) / reading.reference_mm


def _mean_error(readings: Sequence[ReadingTaken]) -> float | None:
    found = [one for one in map(_relative_error, readings) if one is not None]
    return fmean(found) if found else None


def _share_inside(readings: Sequence[ReadingTaken]) -> float | None:
    inside = [not reading.is_outside for reading in readings if reading.interval_mm is not None]
    return fmean(inside) if inside else None
