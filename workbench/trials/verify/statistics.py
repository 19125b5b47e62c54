"""Tests of a calibration: agreement of the lasers with each other, and of ranges with a measured target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.stats import norm_cdf
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.errors import EXPANSION
from workbench.trials.statistics.bias import bias_test
from workbench.trials.target_check import Points, fit_plane

LASERS_ALARM = 0.02
SCALE_ALARM = 0.02
RANGES_ALARM = 0.01
"""Probabilities that a valid calibration is refused, 5 % together. The tests are the lasers against each
other (all placements), the scale of the ranges, and any other error of the ranges."""
MEASURE_AGAIN = "measure the target's standoffs again; if they are right, calibrate again"


@dataclass(frozen=True)
class PlacementCheck:
    """Mean of the readings at one placement."""

    standoff_mm: float
    readings: int
    """Number of readings with a range."""
    range_mm: float | None
    """Mean range of the lasers; None without any range."""
    by_parameter: FloatArray
    """(P,) derivatives of `range_mm` by the parameters of the calibration."""
    own_sd_mm: float
    """1 sigma by noise and speckle of the spots, and by the placement."""
    lasers_p: float | None
    """P value of the lasers' agreement with a plane; None with too few lasers."""
    reference_sd_mm: float = 0.0
    """1 sigma of the standoff."""
    points: Points | None = None
    """Mean ranges of the lasers; None with fewer than two."""

    @property
    def error_mm(self) -> float | None:
        """Measured - true."""
        return None if self.range_mm is None else self.range_mm - self.standoff_mm


@dataclass(frozen=True)
class Change:
    """One change of the sensor, and its support by the errors."""

    name: str
    parameters: tuple[str, ...]
    amount: float
    """Of the first parameter."""
    sd: float
    unit: str
    gain: float
    """Reduction of chi-square, less a penalty for a second parameter."""
    remaining_p: float
    """P value of the errors that the change leaves."""

    @property
    def text(self) -> str:
        """Change with its amount."""
        return f"{self.name} by {self.amount:+.2g} +- {self.sd:.1g} {self.unit}"


@dataclass(frozen=True)
class Verdict:
    """Verdict on a calibration, with the action that follows."""

    valid: bool
    text: str
    action: str
    changes: tuple[Change, ...] = ()
    """Changes of the sensor that explain the errors, each alone, best supported first."""


def check_placement(
    sensor: CalibratedSensor, readings: Sequence[ReadingTaken], reference_sd_mm: float
) -> PlacementCheck:
    """Mean ranges and agreement of the lasers at one placement.

    The noise of a spot is averaged over the readings; its speckle, which stands still, is not.

    Args:
        sensor: the calibrated sensor.
        readings: readings at the placement, at least one.
        reference_sd_mm: standard uncertainty of the standoff.
    """
    standoff_mm = readings[0].standoff_mm
    by_laser = {i: [r for one in readings for r in one.lasers if r.laser_id == i] for i in sensor.ids}
    ids = [i for i in sensor.ids if by_laser[i]]
    counted = sum(one.range_mm is not None for one in readings)
    if not ids:
        return PlacementCheck(standoff_mm, 0, None, np.zeros(len(sensor.covariance)), 0.0, None)
    position = np.array([_mean_px(by_laser[i]) for i in ids])
    spot_sd_px = sensor.calibration.laser_ranger.noise.spot_sd_px
    sd = np.array([[spot_sd_px / sqrt(len(by_laser[i]))] * 2 for i in ids])
    ranges = sensor.ranges(ids, position, sd)
    weight = 1.0 / ranges.spot_sd_mm**2
    weight /= weight.sum()
    points = Points.of(sensor, readings)
    return PlacementCheck(
        standoff_mm,
        counted,
        float(weight @ ranges.range_mm),
        weight @ ranges.by_parameter,
        hypot(float(np.linalg.norm(weight * ranges.spot_sd_mm)), reference_sd_mm),
        None if points is None else fit_plane(points).probability,
        reference_sd_mm,
        points,
    )


def range_covariance(sensor: CalibratedSensor, checks: Sequence[PlacementCheck]) -> FloatArray:
    """(n, n) covariance of the errors at n placements, mm2; they share the error of the calibration."""
    gradient = np.array([check.by_parameter for check in checks])
    own = np.diag([check.own_sd_mm**2 for check in checks])
    return np.asarray(gradient @ sensor.covariance @ gradient.T + own, np.float64)


def predicted_mm(sensor: CalibratedSensor, check: PlacementCheck) -> float:
    """Expanded uncertainty U (k = 2) of the error at one placement."""
    return EXPANSION * float(np.sqrt(range_covariance(sensor, [check])[0, 0]))


def scale_score(errors_mm: FloatArray, covariance: FloatArray, standoffs_mm: FloatArray) -> float:
    """Error common to all ranges in proportion to them, by generalised least squares, in standard deviations.

    A focal length or baselines that have changed move all ranges in this way.

    Args:
        errors_mm: (n,) mean errors.
        covariance: (n, n) of the errors, mm2.
        standoffs_mm: (n,) true ranges.
    """
    weight = np.linalg.solve(covariance, standoffs_mm)
    return float(weight @ errors_mm / np.sqrt(weight @ standoffs_mm))


def lasers_verdict(check: PlacementCheck, placements: int) -> Verdict:
    """Verdict on the lasers against each other at one of several placements."""
    if check.range_mm is None:
        return Verdict(False, "no laser was ranged", "check the lasers, their exposure and the target")
    if check.lasers_p is None or check.lasers_p >= LASERS_ALARM / placements:
        return Verdict(True, "the lasers agree", "measure the target")
    return Verdict(
        False,
        f"the lasers disagree on a flat target (p = {check.lasers_p:.2g})",
        "check that the target is flat and that no laser or lens is loose; then calibrate again",
    )


def range_verdict(sensor: CalibratedSensor, checks: Sequence[PlacementCheck]) -> Verdict:
    """Verdict on the ranges at measured standoffs."""
    found = [(check, error) for check in checks if (error := check.error_mm) is not None]
    if not found:
        return Verdict(False, "no range at any standoff", "check the target and the exposure; verify again")
    errors = np.array([error for _, error in found])
    covariance = range_covariance(sensor, [check for check, _ in found])
    standoffs_mm = np.array([check.standoff_mm for check, _ in found])
    scale_p = 2.0 * float(norm_cdf(-abs(scale_score(errors, covariance, standoffs_mm))))
    p = bias_test(errors, covariance).probability
    if scale_p < SCALE_ALARM:
        text = f"the scale of the ranges has changed (p = {scale_p:.2g}): focal length or baselines"
        return Verdict(False, text, MEASURE_AGAIN)
    if p < RANGES_ALARM:
        return Verdict(False, f"the ranges disagree with the target (p = {p:.2g})", MEASURE_AGAIN)
    return Verdict(True, f"the ranges agree (p = {min(p, scale_p):.2g})", "keep the calibration")


def _mean_px(ranges: Sequence[LaserRange]) -> list[float]:
    """Mean u and v of a laser's spots, px; NaN for a coordinate that was not measured."""
    return [
        float(np.mean([np.nan if px is None else px for px in each]))
        for each in ([one.u_px for one in ranges], [one.v_px for one in ranges])
    ]
