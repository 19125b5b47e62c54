"""Statistics of the accuracy trial: errors of readings of a flat target at a known standoff."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.model.event import ReadingTaken
from workbench.trials.errors import ErrorSpread


@dataclass(frozen=True)
class AccuracyRow:
    """Statistics of one standoff; errors are measured - true, in mm, 1 sigma."""

    standoff_mm: float
    readings: int
    """Number of readings with a range; statistics are of these, and None if there are too few."""
    missing: int = 0
    """Number of readings without a range."""
    mean_error_mm: float | None = None
    max_error_mm: float | None = None
    min_error_mm: float | None = None
    sd_mm: float | None = None
    range_sd_mm: float | None = None
    """Stated standard uncertainty of one reading, from calibration and spots."""
    reference_sd_mm: float | None = None
    """Reference uncertainty of the standoff, of the placement or the rig; None if unknown."""

    @property
    def mean_relative_error(self) -> float | None:
        """Mean error / true range, without unit; None without readings."""
        return None if self.mean_error_mm is None else self.mean_error_mm / self.standoff_mm


def accuracy_row(readings: Sequence[ReadingTaken]) -> AccuracyRow:
    """Statistics of the readings at one standoff; errors are measured - true, mm, 1 sigma.

    The standard deviation over the readings contains only what differs between them. Common errors
    (calibration, speckle, placement) appear in the mean error, to be compared with the stated uncertainties.
    The stated uncertainty of a range contains the ruler's scale, which cancels if the calibration used the
    same ruler.

    Args:
        readings: all readings at the standoff, at least one; those without a range count as missing.
    """
    standoff_mm = readings[0].standoff_mm
    ranges = np.array([r.range_mm for r in readings if r.range_mm is not None])
    stated = np.array([r.sigma_mm for r in readings if r.sigma_mm is not None])
    if not len(ranges):
        return AccuracyRow(
            standoff_mm=standoff_mm,
            readings=0,
            missing=len(readings),
            reference_sd_mm=readings[0].reference_sd_mm,
        )
    spread = ErrorSpread.of(np.array([r.error_mm for r in readings if r.error_mm is not None]))
    return AccuracyRow(
        standoff_mm=standoff_mm,
        readings=len(ranges),
        missing=len(readings) - len(ranges),
        mean_error_mm=spread.mean,
        max_error_mm=spread.largest,
        min_error_mm=spread.smallest,
        sd_mm=spread.sd,
        range_sd_mm=float(np.sqrt((stated**2).mean())),
        reference_sd_mm=readings[0].reference_sd_mm,
    )
