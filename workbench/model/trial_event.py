"""Events of a trial: readings, progress, and results as tables and charts."""

from __future__ import annotations

from math import hypot, inf
from typing import Literal, NamedTuple

from workbench.model.chart import Chart
from workbench.model.table import Table
from workbench.model.target import is_measured
from workbench.model.world import Pose
from workbench.model.yamlfile import FileModel

NOT_VALID = "NO"
"""Cell of a verification's verdict, column `valid`, for a calibration that is not valid."""
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


class TrueValues(FileModel):
    """True values of the readings at one placement, with their reference uncertainties (1 sigma)."""

    range_mm: float
    """Closest range over the front."""
    range_sd_mm: float
    angle_deg: float | None = None
    """None: the target is no incline. It contains the tilt common to all placements, as measured."""
    set_deg: float | None = None
    """Angle as set on the target's mount; None in sessions of versions that did not record it."""
    angle_sd_deg: float | None = None
    radius_mm: float | None = None
    """None: the target is no cylinder."""
    radius_sd_mm: float | None = None


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
    spot_sd_mm: float | None = None
    """Part of `sigma_mm` by noise and speckle of the spots, not of the calibration; None: unknown."""
    flat_true_mm: float | None = None
    """True range of a flat target: the standoff with the ruler's scale and the tilt of the rail as stated in
    the rig file; None: the standoff."""
    reference_sd_mm: float | None = None
    """Reference uncertainty of the true range; None if unknown."""
    placement_sd_mm: float | None = None
    """Part of `reference_sd_mm` that differs between placements; None if unknown."""
    true: TrueValues | None = None
    """True values of a reading of the closest range; None: the range is that of a flat at `standoff_mm`."""
    closest_mm: float | None = None
    """Smallest range over the front, which `workbench range` prints."""
    closest_sigma_mm: float | None = None
    low_mm: float | None = None
    """Lower end of the sensor's 95 % interval of `range_mm`; None: that of `sigma_mm`."""
    high_mm: float | None = None
    """Upper end; None with a lower end: it reaches infinity."""
    shape: str = ""
    """Shape in front of each line of lasers, as `workbench range` names it; empty without a range."""
    angle_deg: float | None = None
    """Angle of an incline, positive where it recedes towards greater x (y for a vertical line of lasers)."""
    angle_sd_deg: float | None = None
    """Stated standard uncertainty of `angle_deg`."""
    radius_mm: float | None = None
    """Radius of the cylinder through the lasers' points; None where none is determined."""
    radius_sd_mm: float | None = None
    cylinder_mm: float | None = None
    """Closest range over the front by that cylinder."""
    cylinder_sd_mm: float | None = None
    left_off: tuple[str, ...] = ()
    """Lasers that were left off."""
    blocked: tuple[str, ...] = ()
    """Lasers whose beams were blocked before the target."""
    notes: tuple[str, ...] = ()
    """Reasons of missing ranges, and remarks on uncertain ones."""
    lasers: tuple[LaserRange, ...]
    lasers_true_mm: tuple[float, ...] = ()
    """True range of each of `lasers` on a flat target, at the place of its spot; empty: no flat, or of an
    earlier version."""

    @property
    def laser_errors_mm(self) -> dict[str, float]:
        """Measured - true range of each laser on a flat target; empty on other targets.

        Readings of earlier versions give the errors from the true value of `range_mm`.
        """
        if self.true is not None:
            return {}
        true_mm = self.lasers_true_mm or (self.reference_mm,) * len(self.lasers)
        return {one.laser_id: one.range_mm - mm for one, mm in zip(self.lasers, true_mm, strict=True)}

    @property
    def reference_mm(self) -> float:
        """True value of `range_mm`."""
        if self.true is not None:
            return self.true.range_mm
        return self.standoff_mm if self.flat_true_mm is None else self.flat_true_mm

    @property
    def is_measured(self) -> bool:
        """Whether the target's standoff was measured; without that the true range is not known."""
        return is_measured(self.standoff_mm, self.reference_sd_mm)

    @property
    def error_mm(self) -> float | None:
        """Measured - true range; None without a range."""
        return None if self.range_mm is None else self.range_mm - self.reference_mm

    @property
    def interval_mm(self) -> tuple[float, float] | None:
        """95 % interval of the true range, by sensor and reference; None if either is unknown.

        The upper end may be infinite.
        """
        if self.range_mm is None or self.sigma_mm is None or self.reference_sd_mm is None:
            return None
        reference_mm = COVERAGE_FACTOR * self.reference_sd_mm
        below_mm = above_mm = COVERAGE_FACTOR * self.sigma_mm
        if self.low_mm is not None:
            below_mm = self.range_mm - self.low_mm
            above_mm = inf if self.high_mm is None else self.high_mm - self.range_mm
        return self.range_mm - hypot(below_mm, reference_mm), self.range_mm + hypot(above_mm, reference_mm)

    @property
    def is_outside(self) -> bool:
        """Whether the true range lies outside the 95 % interval; False if that is not known."""
        interval = self.interval_mm
        return interval is not None and not interval[0] <= self.reference_mm <= interval[1]

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


class VerificationVerdict(NamedTuple):
    """Verdict of a verification on the calibration that it used."""

    valid: bool
    reason: str

    @property
    def text(self) -> str:
        """Verdict with its reason."""
        word = "valid" if self.valid else "not valid"
        return f"the calibration is {word}" + (f": {self.reason}" if self.reason else "")


class TrialFinished(FileModel):
    """Results of a trial as data for any renderer."""

    kind: Literal["trial_finished"] = "trial_finished"
    trial: str
    """Name of the step."""
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()

    @property
    def refuses_calibration(self) -> bool:
        """Whether the verdict of a verification is that the calibration is not valid."""
        return self.verification is not None and not self.verification.valid

    @property
    def verification(self) -> VerificationVerdict | None:
        """Verdict of a verification, the last one if there are several; None for other trials."""
        found = [row for table in self.tables for row in table.records() if "valid" in row]
        if not found:
            return None
        is_valid = all(row["valid"] != NOT_VALID for row in found)
        return VerificationVerdict(is_valid, str(found[-1].get("verdict") or ""))


class SensorAnswer(FileModel):
    """Range that a sensor of a vehicle states for the way ahead."""

    sensor: str
    range_mm: float | None
    low_mm: float | None = None
    high_mm: float | None = None
    """Upper end of the 95 % interval; None with a lower end: it reaches infinity."""
    full_angle_deg: float = 0.0
    """Angle of its cone; 0: the front of the vehicle."""


class VehicleMoved(FileModel):
    """One step of a vehicle in a world, with the answers of its sensors there."""

    kind: Literal["vehicle_moved"] = "vehicle_moved"
    trial: str
    scene: str
    pose: Pose
    clearance_mm: float | None
    """Way ahead until the vehicle touches a body, by the world file; None without one."""
    answers: tuple[SensorAnswer, ...]
