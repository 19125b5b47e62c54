"""Two calibrations of one sensor: do they give the same ranges, and if not, what moved?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.model.stats import chi2_sf
from workbench.sensor.calibrated import CalibratedSensor

Pairs = list[tuple[str, FloatArray]]
"""Laser ids, each with ranges in mm."""
SIGNIFICANCE = 0.01
"""Differences less likely than this by chance mean that something moved."""
STANDOFFS = 12
GAUSS_NEWTON_STEPS = 5
SMALLEST_VARIANCE = 1e-6
"""Directions of the differences with a variance below this part of the largest are left out: what the
calibrations promise there is finer than what the linearised difference of two of them can hold."""
AS_LIKELY_CHI2 = 4.0
"""Explanations whose chi-square is this near to the best one's (2 sigma) cannot be told from it."""


@dataclass(frozen=True)
class Difference:
    """One laser at one range; mm, 1 sigma."""

    laser_id: str
    range_mm: float
    difference_mm: float
    """Range by B - range by A, of the spot that A expects."""
    sd_mm: float
    """Combined standard deviation of both calibrations."""


@dataclass(frozen=True)
class Comparison:
    """The verdict on two calibrations."""

    differences: tuple[Difference, ...]
    chi2: float
    degrees_of_freedom: int
    probability: float
    """Of differences as large as these by chance."""
    moved: bool
    explanations: tuple[str, ...]
    """Parameters of which one alone explains the move, the most likely first; empty: no single one does."""
    identical: bool = False
    """Whether both have the same numbers, to the last digit: copies of one calibration."""


def compare(a: Calibration, b: Calibration) -> Comparison:
    """Compare two calibrations over the ranges and lasers that both have.

    What is tested is where the two expect each laser's spot along its axis, which is linear in the parameters
    where ranges are not, with the covariance of both calibrations added: right for what each session's data
    determined; for what rests on priors that both share it overstates the deviation. The ranges differ as
    they do when B ranges the spot that A expects.

    Raises:
        BadInputError: the lasers, the picture's size or the standoffs have nothing in common.
    """
    sensor_a, sensor_b = CalibratedSensor(a), CalibratedSensor(b)
    pairs = _visible(sensor_a, sensor_b, _common_ranges(a, b))
    shift_px = _spots(sensor_b, pairs) - _spots(sensor_a, pairs)
    whiten = _whitener(_spot_covariance(sensor_a, pairs) + _spot_covariance(sensor_b, pairs))
    white = whiten @ shift_px
    chi2 = float(white @ white)
    probability = float(chi2_sf(chi2, len(white)))
    moved = probability < SIGNIFICANCE
    return Comparison(
        differences=_differences(sensor_a, sensor_b, pairs),
        chi2=chi2,
        degrees_of_freedom=len(white),
        probability=probability,
        moved=moved,
        explanations=_explanations(sensor_a, b, pairs, whiten) if moved else (),
        identical=_numbers(a) == _numbers(b),
    )


def _numbers(calibration: Calibration) -> tuple[object, ...]:
    """All that a ranger takes from it."""
    ours = calibration.laser_ranger
    return calibration.geometry(), ours.lasers, ours.noise, ours.parameters, ours.validity


def _spots(sensor: CalibratedSensor, pairs: Pairs) -> FloatArray:
    """(n,) where the sensor expects the spots along each laser's axis, px."""
    return np.concatenate([sensor.spot_px(i, r)[:, _axis(sensor, i)] for i, r in pairs])


def _spot_gradient(sensor: CalibratedSensor, pairs: Pairs) -> FloatArray:
    """(n, P) derivatives of `_spots` by the parameters."""
    return np.concatenate([sensor.spot_gradient(i, r)[:, _axis(sensor, i)] for i, r in pairs])


def _spot_covariance(sensor: CalibratedSensor, pairs: Pairs) -> FloatArray:
    """(n, n) of `_spots`, by the calibration's covariance."""
    gradient = _spot_gradient(sensor, pairs)
    return gradient @ sensor.calibration.laser_ranger.parameters.covariance_array @ gradient.T


def _axis(sensor: CalibratedSensor, laser_id: str) -> int:
    return "uv".index(sensor.calibration.laser_ranger.lasers[sensor.ids.index(laser_id)].axis)


def _differences(a: CalibratedSensor, b: CalibratedSensor, pairs: Pairs) -> tuple[Difference, ...]:
    found = []
    for laser_id, at in pairs:
        spots = a.spot_px(laser_id, at)
        by_a, by_b = (s.ranges([laser_id] * len(at), spots, np.full_like(spots, np.nan)) for s in (a, b))
        variance = np.diag(by_a.covariance_mm2) - by_a.spot_sd_mm**2
        variance = variance + np.diag(by_b.covariance_mm2) - by_b.spot_sd_mm**2
        rows = zip(at, by_b.range_mm - at, np.sqrt(variance), strict=True)
        found += [Difference(laser_id, float(r), float(d), float(sd)) for r, d, sd in rows]
    return tuple(found)


def _common_ranges(a: Calibration, b: Calibration) -> FloatArray:
    for what, of_a, of_b in (
        ("image size", (a.image_width, a.image_height), (b.image_width, b.image_height)),
        ("lasers", _laser_ids(a), _laser_ids(b)),
    ):
        if of_a != of_b:
            raise BadInputError(f"{what}: expected the same in both calibrations, got {of_a} and {of_b}")
    ranges = [c.laser_ranger.validity.standoff_mm for c in (a, b)]
    nearest, farthest = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if nearest >= farthest:
        raise BadInputError(f"validity: expected standoffs in common, got {ranges[0]} and {ranges[1]} mm")
    return np.geomspace(nearest, farthest, STANDOFFS)


def _laser_ids(calibration: Calibration) -> tuple[str, ...]:
    return tuple(laser.id for laser in calibration.laser_ranger.lasers)


def _visible(a: CalibratedSensor, b: CalibratedSensor, grid: FloatArray) -> Pairs:
    """Each laser with the ranges at which both calibrations expect its spot in the picture."""
    return [(i, grid[a.in_frame(i, grid) & b.in_frame(i, grid)]) for i in a.ids]


def _whitener(covariance: FloatArray) -> FloatArray:
    """(k, n): from n differences to k independent ones of variance 1."""
    variance, direction = np.linalg.eigh(covariance)
    kept = variance > SMALLEST_VARIANCE * variance[-1]
    return np.asarray((direction[:, kept] / np.sqrt(variance[kept])).T)


def _explanations(a: CalibratedSensor, b: Calibration, pairs: Pairs, whiten: FloatArray) -> tuple[str, ...]:
    """Parameters of B of which one alone, put back, brings the difference down to chance."""
    expected = _spots(a, pairs)
    parameters = b.laser_ranger.parameters
    remaining: dict[str, float] = {}
    for column, (name, value) in enumerate(zip(parameters.names, parameters.values, strict=True)):
        if name in b.geometry():
            remaining[name] = _put_back(b, pairs, whiten, expected, column, value)
    best = min(remaining.values())
    if chi2_sf(best, len(whiten) - 1) < SIGNIFICANCE:
        return ()
    likely = [name for name, chi2 in remaining.items() if chi2 < best + AS_LIKELY_CHI2]
    return tuple(sorted(likely, key=remaining.__getitem__))


def _put_back(
    b: Calibration, pairs: Pairs, whiten: FloatArray, expected: FloatArray, column: int, value: float
) -> float:
    """Chi-square that is left when one parameter of B takes the value that suits A best (Gauss-Newton)."""
    name = b.laser_ranger.parameters.names[column]
    chi2 = float("inf")
    for _ in range(GAUSS_NEWTON_STEPS):
        sensor = CalibratedSensor(b, {name: value})
        white = whiten @ (_spots(sensor, pairs) - expected)
        chi2 = float(white @ white)
        slope = whiten @ _spot_gradient(sensor, pairs)[:, column]
        if not (strength := float(slope @ slope)):
            break
        value -= float(slope @ white) / strength
    return chi2
