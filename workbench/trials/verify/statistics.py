"""Mean ranges of the lasers at one placement of a verification, and their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange, ReadingTaken
from workbench.sensor.calibrated import CalibratedSensor, X, Y
from workbench.trials.errors import EXPANSION
from workbench.trials.reference import true_ranges_mm
from workbench.trials.target_check import Points, fit_plane
from workbench.trials.verify.reference import Reference

MARGIN = 0.03
"""Relative error of a standoff for which a spot that must be seen is still in the picture."""


@dataclass(frozen=True)
class PlacementCheck:
    """Means of the readings of n lasers at one placement; n may be 0."""

    standoff_mm: float
    reference_sd_mm: float
    """1 sigma of the standoff."""
    readings: int
    """Number of readings with a range."""
    laser_mm: FloatArray
    """(n,) ranges of the lasers."""
    by_parameter: FloatArray
    """(n, P) their derivatives by the parameters of the calibration."""
    spot_sd_mm: FloatArray
    """(n,) 1 sigma of the ranges by noise and speckle of the spots."""
    place_mm: FloatArray
    """(n, 2) x and y of the spots."""
    lasers_p: float | None
    """P value of the lasers' agreement with a plane; None with too few lasers."""
    missing: tuple[str, ...] = ()
    """Lasers without a range, although their spots must be in the picture by the calibration."""

    @property
    def weight(self) -> FloatArray:
        """(n,) weights of the lasers in the mean range."""
        weight = 1.0 / self.spot_sd_mm**2
        return np.asarray(weight / weight.sum(), np.float64)

    @property
    def range_mm(self) -> float | None:
        """Mean range of the lasers; None without any range."""
        return float(self.weight @ self.laser_mm) if len(self.laser_mm) else None

    def true_mm(self, reference: Reference) -> FloatArray:
        """(n,) expected true ranges of the lasers, with the ruler's scale and the target's common tilt."""
        return true_ranges_mm(self.standoff_mm, reference.shared, self.place_mm)

    def error_mm(self, reference: Reference) -> float | None:
        """Measured - true mean range; None without any range."""
        if not len(self.laser_mm):
            return None
        return float(self.weight @ (self.laser_mm - self.true_mm(reference)))

    @property
    def by_shared(self) -> FloatArray:
        """(n, 3) derivatives of the true ranges by ruler scale and common tilt: standoff, x and y."""
        return np.column_stack([np.full(len(self.laser_mm), self.standoff_mm), self.place_mm])


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
    missing = tuple(i for i in sensor.ids if i not in ids and _must_be_seen(sensor, i, standoff_mm))
    counted = sum(one.range_mm is not None for one in readings)
    if not ids:
        none = np.zeros((0, len(sensor.covariance)))
        empty = np.zeros(0)
        return PlacementCheck(
            standoff_mm, reference_sd_mm, 0, empty, none, empty, np.zeros((0, 2)), None, missing
        )
    position = np.array([_mean_px(by_laser[i]) for i in ids])
    spot_sd_px = sensor.calibration.laser_ranger.noise.spot_sd_px
    sd = np.array([[spot_sd_px / sqrt(len(by_laser[i]))] * 2 for i in ids])
    ranges = sensor.ranges(ids, position, sd)
    points = Points.of(sensor, readings)
    return PlacementCheck(
        standoff_mm,
        reference_sd_mm,
        counted,
        ranges.range_mm,
        ranges.by_parameter,
        ranges.spot_sd_mm,
        np.column_stack([sensor.places(ids, axis, ranges)[0] for axis in (X, Y)]),
        None if points is None else fit_plane(points).probability,
        missing,
    )


def _must_be_seen(sensor: CalibratedSensor, laser_id: str, standoff_mm: float) -> bool:
    """Whether a laser's spot lies in the picture for all ranges about a standoff that is calibrated."""
    nearest, farthest = sensor.calibration.laser_ranger.validity.standoff_mm
    about_mm = standoff_mm * np.array([1.0 - MARGIN, 1.0, 1.0 + MARGIN])
    return nearest <= standoff_mm <= farthest and bool(sensor.in_frame(laser_id, about_mm).all())


def predicted_mm(reference: Reference, check: PlacementCheck) -> float:
    """Expanded uncertainty U (k = 2) of the error at one placement, by all its sources."""
    weight, by_shared = check.weight, check.weight @ check.by_shared
    gradient = reference.gradient((weight @ check.by_parameter)[None], by_shared[None])
    variance = float((gradient @ reference.covariance @ gradient.T)[0, 0])
    spots, tilt_mm = weight * check.spot_sd_mm, reference.tilt_sd * by_shared[1:]
    return EXPANSION * sqrt(
        max(variance, 0.0) + float(spots @ spots + tilt_mm @ tilt_mm) + check.reference_sd_mm**2
    )


def _mean_px(ranges: Sequence[LaserRange]) -> list[float]:
    """Mean u and v of a laser's spots, px; NaN for a coordinate that was not measured."""
    return [
        float(np.mean([np.nan if px is None else px for px in each]))
        for each in ([one.u_px for one in ranges], [one.v_px for one in ranges])
    ]
