"""Events of a trial: readings, progress, and results as tables and charts."""

from __future__ import annotations

from math import hypot
from typing import Literal

from workbench.model.chart import Chart
from workbench.model.table import Table
from workbench.model.yamlfile import FileModel

COVERAGE_FACTOR = 1.959963984540054
"""Half width of the 95 % interval of a normal error, in standard deviations."""
STATUS_TEXT = {
    "done": "no range",
    "not_enough_points": "too few spots could be assigned to lasers",
    "no_points": "no spot was seen",
}
"""Cause of a missing range without notes, by the status of the reading."""


class LaserRange(FileModel):
    """Range of one laser's spot from the reference plane, 1 sigma."""

    laser_id: str
    range_mm: float
    sigma_mm: float
    u_px: float | None
    v_px: float | None
    low_mm: float | None = None
    high_mm: float | None = None
    """Upper end of the 95 % interval, which is not symmetric; None if it reaches infinity."""


class ReadingTaken(FileModel):
    """One reading of a trial."""

    kind: Literal["reading_taken"] = "reading_taken"
    trial: str
    scene: str
    standoff_mm: float
    reading: int
    status: Literal["done", "not_enough_points", "no_points"]
    range_mm: float | None
    """Mean of the lasers weighted by their spots' uncertainty: the range of a flat target."""
    sigma_mm: float | None
    """Stated standard uncertainty of `range_mm`."""
    reference_sd_mm: float | None = None
    """Reference uncertainty of the true range; None if unknown."""
    true_mm: float | None = None
    """True range, if it is not `standoff_mm`: the target is no flat across the axis."""
    closest_mm: float | None = None
    """Smallest range over the front, which `workbench range` prints."""
    closest_sigma_mm: float | None = None
    shape: str = ""
    """Shape in front of each line of lasers, as `workbench range` names it; empty without a range."""
    angle_deg: float | None = None
    """Angle of an incline, positive where it recedes towards greater x (y for a vertical line of lasers)."""
    angle_sd_deg: float | None = None
    """Stated standard uncertainty of `angle_deg`."""
    radius_mm: float | None = None
    """Radius of the cylinder through the lasers' points; None where none is determined."""
    radius_sd_mm: float | None = None
    left_off: tuple[str, ...] = ()
    """Lasers that were left off."""
    notes: tuple[str, ...] = ()
    """Reasons of missing ranges, and remarks on uncertain ones."""
    lasers: tuple[LaserRange, ...]

    @property
    def reference_mm(self) -> float:
        """True value of `range_mm`."""
        return self.standoff_mm if self.true_mm is None else self.true_mm

    @property
    def error_mm(self) -> float | None:
        """Measured - true range; None without a range."""
        return None if self.range_mm is None else self.range_mm - self.reference_mm

    @property
    def half_interval_mm(self) -> float | None:
        """Half width of the 95 % interval of the error, by sensor and reference; None if one is unknown."""
        if self.sigma_mm is None or self.reference_sd_mm is None:
            return None
        return COVERAGE_FACTOR * hypot(self.sigma_mm, self.reference_sd_mm)

    @property
    def is_outside(self) -> bool:
        """Whether the error lies outside its 95 % interval; False if that is not known."""
        error, half = self.error_mm, self.half_interval_mm
        return error is not None and half is not None and abs(error) > half

    @property
    def cause(self) -> str:
        """Cause of a missing range; empty for a reading with a range."""
        if self.range_mm is not None:
            return ""
        return "; ".join(self.notes) or STATUS_TEXT[self.status]


class TrialProgress(FileModel):
    """A part of a trial is complete."""

    kind: Literal["trial_progress"] = "trial_progress"
    trial: str
    text: str
    """Summary in one line."""


class TrialFinished(FileModel):
    """Results of a trial as data for any renderer."""

    kind: Literal["trial_finished"] = "trial_finished"
    trial: str
    """Name of the step."""
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
