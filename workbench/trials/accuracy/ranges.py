"""Ranges of one reading of a flat target: closest, mean and each laser, with their sensitivities.

The target is flat. Its tilt changes the range of each laser by tilt x distance of the spot from the optical
axis. It always brings one end of the front nearer: see `reference.near_end`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, inf, sqrt

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.ranging.lines import shape_variance
from workbench.ranging.ranger import Reading
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.reference import Reference, TiltEffect, front_ends, laser_estimates, places_of

CLOSEST, MEAN = "closest", "mean"
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
    tilt: TiltEffect
    """Effect of the target's tilt on the true range."""
    shape_sd_mm: float = 0.0
    """1 sigma by the choice between shapes: a slight tilt may count as none, noise as a tilt."""


@dataclass(frozen=True)
class RangeError:
    """One range of one reading."""

    error_mm: float
    """Measured - true."""
    is_inside: bool
    """Whether the true range lies in the 95 % interval, by sensor and reference."""
    sensitivities: Sensitivities


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
    found = _sensitivities(sensor, reading, reference)
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
            range_mm - reference.true_mm(found[name].tilt),
            _is_inside(range_mm, interval, reference, found[name].tilt),
            found[name],
        )
        for name, (range_mm, interval) in stated.items()
    }


def _sensitivities(
    sensor: CalibratedSensor, reading: Reading, reference: Reference
) -> Mapping[str, Sensitivities]:
    ids = [one.laser_id for one in reading.lasers]
    ranges = laser_estimates(sensor, reading.lasers)
    places = places_of(sensor, reading.lasers, ranges)
    weight = ranges.spot_sd_mm**-2 / (ranges.spot_sd_mm**-2).sum()
    spot_sd_mm, share = _own_noise(sensor, reading, float((ranges.spot_sd_mm**-2).sum() ** -0.5))
    at_mean = reference.at_point(_point(weight @ places))
    mean = Sensitivities(weight @ ranges.by_parameter, spot_sd_mm[0], share, at_mean)
    lasers = {
        i: Sensitivities(
            ranges.by_parameter[n],
            spot_sd_mm[1] * float(ranges.spot_sd_mm[n]),
            share,
            reference.at_point(_point(places[n])),
        )
        for n, i in enumerate(ids)
    }
    nearest = min(reading.lines, key=lambda line: line.shape.closest_mm)
    closest = Sensitivities(
        nearest.closest_by_parameter,
        float(np.linalg.norm(nearest.closest_spot_sd_mm)),
        share,
        reference.at_near_end(front_ends(sensor, reading.lasers[0].range_mm)),
        sqrt(shape_variance(nearest, sensor.covariance)),
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


def _is_inside(range_mm: float, interval: Interval, reference: Reference, tilt: TiltEffect) -> bool:
    low_mm, high_mm = interval
    sd_mm = COVERAGE_FACTOR * reference.sd_mm(tilt)
    error_mm = range_mm - reference.true_mm(tilt)
    above_mm = inf if high_mm is None else high_mm - range_mm
    return -hypot(above_mm, sd_mm) <= error_mm <= hypot(range_mm - low_mm, sd_mm)


def _interval(laser: LaserRange) -> Interval:
    if laser.low_mm is None:
        return _symmetric(laser.range_mm, laser.sigma_mm)
    return laser.low_mm, laser.high_mm


def _symmetric(range_mm: float, sigma_mm: float) -> Interval:
    return range_mm - COVERAGE_FACTOR * sigma_mm, range_mm + COVERAGE_FACTOR * sigma_mm


def _point(place_mm: FloatArray) -> tuple[float, float]:
    return float(place_mm[0]), float(place_mm[1])
