"""Statistics of the accuracy trial: errors of readings of a flat at a known standoff."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.model.event import ReadingTaken


@dataclass(frozen=True)
class AccuracyRow:
    """Statistics of one standoff; errors are measured - true, in mm, 1 sigma."""

    standoff_mm: float
    readings: int
    """With a range; the numbers below are of these, and None where there are too few of them."""
    missing: int = 0
    """Readings without a range."""
    mean_error_mm: float | None = None
    max_error_mm: float | None = None
    min_error_mm: float | None = None
    sd_mm: float | None = None
    range_sd_mm: float | None = None
    """Stated standard uncertainty of one reading: calibration and spots."""
    reference_sd_mm: float | None = None
    """Reference uncertainty of the standoff: the placement's own or the rig's; None where not known."""

    @property
    def mean_relative_error(self) -> float | None:
        """Mean error over the true range, without unit; None without readings."""
        return None if self.mean_error_mm is None else self.mean_error_mm / self.standoff_mm


def accuracy_row(readings: Sequence[ReadingTaken]) -> AccuracyRow:
    """Statistics of the readings at one standoff; errors are measured - true, mm, 1 sigma.

    The standard deviation over the readings shows what differs between them. What they share (calibration,
    speckle, placement) it cannot show: hold the mean error against the stated deviations instead. The range's
    contains the ruler's scale, which cancels where the calibration was made with the same ruler.

    Args:
        readings: every reading taken there, at least one; those without a range count as missing.
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
    error = ranges - standoff_mm
    return AccuracyRow(
        standoff_mm=standoff_mm,
        readings=len(ranges),
        missing=len(readings) - len(ranges),
        mean_error_mm=float(error.mean()),
        max_error_mm=float(error.max()),
        min_error_mm=float(error.min()),
        sd_mm=float(error.std(ddof=1)) if len(error) > 1 else None,
        range_sd_mm=float(np.sqrt((stated**2).mean())),
        reference_sd_mm=readings[0].reference_sd_mm,
    )
