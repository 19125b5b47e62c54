"""Statistics of the missing-spots trial: errors with missing spots, relative to those of all lasers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np

from workbench.model.event import ReadingTaken
from workbench.trials.missing_spots.sets import Condition
from workbench.trials.statistics.coverage import clopper_pearson, effective_number, upper_bound


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
    """95 % interval of `coverage` (Clopper-Pearson). It counts effective placements: the readings of
    one share its error, and all placements share that of the calibration."""
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
    known = [of for of in taken if any(reading.interval_mm is not None for reading in of)]
    shares = [_share_inside(of) for of in known]
    low, high = _interval(fmean(shares), known) if shares else (None, None)
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


def _share_inside(readings: Sequence[ReadingTaken]) -> float:
    """Share of the readings with an interval, at least one, whose interval contains the true range."""
    return fmean(not reading.is_outside for reading in readings if reading.interval_mm is not None)


def _interval(share: float, placements: Sequence[Sequence[ReadingTaken]]) -> tuple[float, float]:
    """95 % interval of a share at placements whose readings have intervals.

    The sensor's whole stated uncertainty is taken as the calibration's, common to all placements. A part of
    it is noise, which makes the interval wider than necessary.
    """
    common = np.array([_common_share(of) for of in placements])
    correlation = np.sqrt(np.outer(common, common))
    np.fill_diagonal(correlation, 1.0)
    number = effective_number(correlation)
    return clopper_pearson(share * number, number)


def _common_share(readings: Sequence[ReadingTaken]) -> float:
    """Share of the sensor's variance in that of sensor and reference."""
    sensor, reference = (
        fmean(sd**2 for sd in sds if sd is not None)
        for sds in ([r.sigma_mm for r in readings], [r.reference_sd_mm for r in readings])
    )
    return sensor / (sensor + reference) if sensor > 0 else 0.0
