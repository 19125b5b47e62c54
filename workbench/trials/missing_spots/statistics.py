"""Statistics of the missing-spots trial: errors with missing spots, relative to those of all lasers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from workbench.model.event import ReadingTaken
from workbench.trials.missing_spots.sets import Condition
from workbench.trials.statistics.coverage import clopper_pearson, upper_bound


@dataclass(frozen=True)
class MissingSummary:
    """Errors of all readings with one number of missing spots."""

    condition: Condition
    readings: int
    """Number of readings with a range."""
    without_range: int
    mean_absolute_relative_error: float | None
    ratio: float | None
    """`mean_absolute_relative_error` / that of all lasers, over the placements with ranges of both; None if
    that of all lasers is 0."""
    coverage: float | None
    """Share of readings whose 95 % interval contains the true range."""
    coverage_low: float | None
    coverage_high: float | None
    """95 % interval of `coverage` (Clopper-Pearson). It counts placements, as the readings of one share its
    error."""
    lost: float
    """Share of readings without a range."""
    lost_high: float
    """Upper 95 % bound of `lost` (one-sided, Clopper-Pearson, by placement)."""


def missing_summary(
    condition: Condition, taken: Sequence[Sequence[ReadingTaken]], full: Sequence[Sequence[ReadingTaken]]
) -> MissingSummary:
    """Summary of readings under one condition.

    Args:
        condition: number and cause of the missing spots.
        taken: readings at each placement.
        full: readings of all lasers at the same placements.
    """
    readings = [reading for of in taken for reading in of]
    pairs = [(_mean_error(own), _mean_error(whole)) for own, whole in zip(taken, full, strict=True)]
    both = [(own, whole) for own, whole in pairs if own is not None and whole is not None]
    relative = [one for one in map(_relative_error, readings) if one is not None]
    shares = [share for of in taken if (share := _share_inside(of)) is not None]
    low, high = clopper_pearson(sum(shares), len(shares)) if shares else (None, None)
    lost = [fmean(one.range_mm is None for one in of) for of in taken]
    whole_error = fmean(whole for _, whole in both) if both else 0.0
    return MissingSummary(
        condition,
        len(relative),
        len(readings) - len(relative),
        fmean(relative) if relative else None,
        fmean(own for own, _ in both) / whole_error if whole_error else None,
        fmean(shares) if shares else None,
        low,
        high,
        fmean(lost),
        upper_bound(sum(lost), len(lost)),
    )


def _relative_error(reading: ReadingTaken) -> float | None:
    return None if reading.error_mm is None else abs(reading.error_mm) / reading.reference_mm


def _mean_error(readings: Sequence[ReadingTaken]) -> float | None:
    found = [one for one in map(_relative_error, readings) if one is not None]
    return fmean(found) if found else None


def _share_inside(readings: Sequence[ReadingTaken]) -> float | None:
    inside = [not reading.is_outside for reading in readings if reading.interval_mm is not None]
    return fmean(inside) if inside else None
