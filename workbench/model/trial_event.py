"""Readings of a trial, and their statistics."""

from __future__ import annotations

from typing import Literal

from workbench.model.yamlfile import FileModel


class LaserRange(FileModel):
    """Range of one laser's spot, from the reference plane; 1 sigma."""

    laser_id: str
    range_mm: float
    sigma_mm: float
    u_px: float | None
    v_px: float | None
    low_mm: float | None = None
    high_mm: float | None = None
    """The 95 % interval, longer beyond the range than before it; no upper end where it reaches infinity."""


class ReadingTaken(FileModel):
    """One reading of a trial."""

    kind: Literal["reading_taken"] = "reading_taken"
    trial: str
    scene: str
    standoff_mm: float
    reading: int
    status: Literal["done", "not_enough_points", "no_points"]
    range_mm: float | None
    sigma_mm: float | None
    lasers: tuple[LaserRange, ...]


class TrialRow(FileModel):
    """Statistics of one standoff of an accuracy trial; errors are measured - true, in mm, 1 sigma."""

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
    """Stated standard deviation of one reading: calibration and spots."""
    reference_sd_mm: float
    """Standard deviation of the true range itself: the placement's, by the ruler."""


class TrialFinished(FileModel):
    """A trial's table."""

    kind: Literal["trial_finished"] = "trial_finished"
    trial: str
    rows: tuple[TrialRow, ...]
