"""Ranges of one reading of a flat target: closest, mean and each laser, with their sensitivities.

The target is flat. Its tilt changes the range of each laser by tilt x distance of the spot from the optical
axis. It changes the closest range by tilt x distance of the near end of the front.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, inf, isfinite, radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.rig import BenchSpec, ImageAxis
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.ranging.ranger import Reading
from workbench.sensor.calibrated import CalibratedSensor

CLOSEST, MEAN = "closest", "mean"
AXES: tuple[ImageAxis, ImageAxis] = ("u", "v")
Interval = tuple[float, float | None]
"""95 % interval of the sensor, mm; None: it reaches infinity."""


@dataclass(frozen=True)
class Sensitivities:
    """Sensitivities of one range to its sources of error."""

    by_parameter: FloatArray
    """(P,) derivatives by the parameters of the calibration, mm per unit of the parameter."""
    spot_sd_mm: float
    """1 sigma by noise and speckle of the spots of one reading."""
    speckle_share: float
    """Share of speckle in the variance `spot_sd_mm`^2; the rest is noise, which differs between readings."""
    arms_mm: tuple[float, float]
    """Derivatives by the tilt of the target about the vertical and the horizontal axis, mm per radian."""


@dataclass(frozen=True)
class RangeError:
    """One range of one reading."""

    error_mm: float
    """Measured - true."""
    is_inside: bool
    """Whether the true range lies in the 95 % interval, by sensor and reference."""
    sensitivities: Sensitivities


@dataclass(frozen=True)
class Reference:
    """True ranges at one placement of a flat target, and their standard uncertainties."""

    standoff_mm: float
    standoff_sd_mm: float
    tilt: tuple[float, float] = (0.0, 0.0)
    """Slopes of the tilt common to all placements, as measured, about the vertical and the horizontal."""
    tilt_sd: float = 0.0
    """Standard uncertainty of the tilt at one placement about each axis, rad."""
    common_tilt_sd: float = 0.0
    """Standard uncertainty of the tilt common to all placements about each axis, rad."""

    @classmethod
    def of(cls, bench: BenchSpec, standoff_mm: float, standoff_sd_mm: float | None) -> Reference:
        """Reference of a placement; without a stated uncertainty that of the rig's bench counts."""
        return cls(
            standoff_mm,
            bench.placement_sd_mm if standoff_sd_mm is None else standoff_sd_mm,
            (tan(radians(bench.target_yaw_deg)), tan(radians(bench.target_pitch_deg))),
            radians(bench.tilt_sd_deg),
            radians(bench.target_tilt_sd_deg),
        )

    def true_mm(self, arms_mm: tuple[float, float]) -> float:
        """True range at the arms of a range."""
        return self.standoff_mm + self.tilt[0] * arms_mm[0] + self.tilt[1] * arms_mm[1]

    def own_sd_mm(self, arms_mm: tuple[float, float]) -> float:
        """1 sigma by the placement alone."""
        return hypot(self.standoff_sd_mm, self.tilt_sd * hypot(*arms_mm))

    def sd_mm(self, arms_mm: tuple[float, float]) -> float:
        """1 sigma by the placement and the tilt common to all."""
        return hypot(self.own_sd_mm(arms_mm), self.common_tilt_sd * hypot(*arms_mm))


def range_errors(
    sensor: CalibratedSensor, reading: Reading, taken: ReadingTaken, reference: Reference
) -> dict[str, RangeError]:
    """Errors of the closest range, the mean range and each laser's range; empty without a range.

    Args:
        sensor: the calibrated sensor.
        reading: reading of the ranger.
        taken: the same reading as journalled.
        reference: its true range.
    """
    if reading.closest_mm is None or reading.sigma_mm is None or taken.range_mm is None:
        return {}
    found = _sensitivities(sensor, reading, reference.tilt)
    stated: dict[str, tuple[float, Interval]] = {
        CLOSEST: (
            reading.closest_mm,
            reading.interval_mm or _symmetric(reading.closest_mm, reading.sigma_mm),
        ),
        MEAN: (taken.range_mm, _symmetric(taken.range_mm, taken.sigma_mm or 0.0)),
        **{one.laser_id: (one.range_mm, _interval(one)) for one in reading.lasers},
    }
    return {
        name: RangeError(
            range_mm - reference.true_mm(found[name].arms_mm),
            _is_inside(range_mm, interval, reference, found[name].arms_mm),
            found[name],
        )
        for name, (range_mm, interval) in stated.items()
    }


def _sensitivities(
    sensor: CalibratedSensor, reading: Reading, tilt: tuple[float, float]
) -> Mapping[str, Sensitivities]:
    ids = [one.laser_id for one in reading.lasers]
    position = np.array([[_number(one.u_px), _number(one.v_px)] for one in reading.lasers])
    ranges = sensor.ranges(ids, position, np.full_like(position, np.nan))
    places = np.stack([sensor.places(ids, axis, ranges)[0] for axis in AXES], axis=1)
    weight = ranges.spot_sd_mm**-2 / (ranges.spot_sd_mm**-2).sum()
    spot_sd_mm, share = _own_noise(sensor, reading, float((ranges.spot_sd_mm**-2).sum() ** -0.5))
    mean = Sensitivities(weight @ ranges.by_parameter, spot_sd_mm[0], share, _arms(weight @ places))
    lasers = {
        i: Sensitivities(
            ranges.by_parameter[n], spot_sd_mm[1] * float(ranges.spot_sd_mm[n]), share, _arms(places[n])
        )
        for n, i in enumerate(ids)
    }
    nearest = min(reading.lines, key=lambda line: line.shape.closest_mm)
    closest = Sensitivities(
        nearest.closest_by_parameter,
        float(np.linalg.norm(nearest.closest_spot_sd_mm)),
        share,
        _near_end(sensor, tilt),
    )
    return {CLOSEST: closest, MEAN: mean, **lasers}


def _own_noise(
    sensor: CalibratedSensor, reading: Reading, typical_mm: float
) -> tuple[tuple[float, float], float]:
    """1 sigma of the mean range by its spots, mm, its ratio to the typical one, and the share of speckle.

    Spots state noise of their own; that in the calibration is typical. Speckle is that of the calibration.
    """
    own_mm = typical_mm if reading.flat_spot_sd_mm is None else reading.flat_spot_sd_mm
    noise, ratio = sensor.calibration.laser_ranger.noise, own_mm / typical_mm
    share = noise.speckle_sd_px**2 / (noise.spot_sd_px**2 + noise.speckle_sd_px**2)
    return (own_mm, ratio), min(1.0, share / ratio**2)


def _near_end(sensor: CalibratedSensor, tilt: tuple[float, float]) -> tuple[float, float]:
    """End of a front that the tilt brings nearest, x and y in mm; without a tilt the farthest one."""
    ends = [(0.0, 0.0)]
    for n, axis in enumerate(AXES):
        if len(sensor.lasers_on(axis)):
            ends += [(end, 0.0) if n == 0 else (0.0, end) for end in sensor.front_mm(axis)]
    return min(ends, key=lambda end: (tilt[0] * end[0] + tilt[1] * end[1], -hypot(*end)))


def _is_inside(
    range_mm: float, interval: Interval, reference: Reference, arms_mm: tuple[float, float]
) -> bool:
    low_mm, high_mm = interval
    sd_mm = COVERAGE_FACTOR * reference.sd_mm(arms_mm)
    error_mm = range_mm - reference.true_mm(arms_mm)
    above_mm = inf if high_mm is None else high_mm - range_mm
    return -hypot(above_mm, sd_mm) <= error_mm <= hypot(range_mm - low_mm, sd_mm)


def _interval(laser: LaserRange) -> Interval:
    if laser.low_mm is None:
        return _symmetric(laser.range_mm, laser.sigma_mm)
    return laser.low_mm, laser.high_mm


def _symmetric(range_mm: float, sigma_mm: float) -> Interval:
    return range_mm - COVERAGE_FACTOR * sigma_mm, range_mm + COVERAGE_FACTOR * sigma_mm


def _arms(place_mm: FloatArray) -> tuple[float, float]:
    return float(place_mm[0]), float(place_mm[1])


def _number(px: float | None) -> float:
    return np.nan if px is None or not isfinite(px) else px
