"""Comparison of two calibrations of one sensor: difference of ranges, significance, likely cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.calibration.estimation.gauss_newton import gauss_newton
from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.model.stats import chi2_sf
from workbench.sensor.calibrated import CalibratedSensor

RangesByLaser = list[tuple[str, FloatArray]]
"""Laser ids, each with ranges in mm."""
SIGNIFICANCE = 0.01
"""P value of the differences below which the sensor has changed."""
RANGES = 12
"""Number of ranges at which the calibrations are compared."""
GAUSS_NEWTON_STEPS = 4
SMALLEST_VARIANCE = 1e-6
"""Share of the largest variance below which directions of the differences are omitted: there the stated
variances are smaller than the error of linearising the difference."""
AS_LIKELY_CHI2 = 4.0
"""Difference of chi-square (2 sigma) within which explanations are equally likely."""


@dataclass(frozen=True)
class Difference:
    """Difference of the ranges of one laser at one range; mm, 1 sigma."""

    laser_id: str
    range_mm: float
    difference_mm: float
    """Range by B - range by A, of the spot that A predicts."""
    sd_mm: float
    """Combined standard deviation of both calibrations."""


@dataclass(frozen=True)
class Comparison:
    """Verdict on two calibrations."""

    differences: tuple[Difference, ...]
    chi2: float
    degrees_of_freedom: int
    probability: float
    """P value of the differences."""
    moved: bool
    """Whether the differences are significant."""
    explanations: tuple[str, ...]
    """Parameters each of which explains the differences alone, the most likely first; empty: none does."""
    identical: bool = False
    """Whether both have the same numbers to the last digit, as copies of one calibration have."""
    notes: tuple[str, ...] = ()
    """Reservations about the verdict."""


def compare(a: Calibration, b: Calibration) -> Comparison:
    """Compare two calibrations over the ranges that both cover.

    The test compares the predicted positions of each laser's spot along its axis, which unlike ranges are
    nearly linear in the parameters. Their covariance is the sum of both calibrations': correct for what the
    data of each session determine, too large for what rests on priors that both share. The reported
    difference of ranges is that of B for the spot that A predicts.

    Raises:
        BadInputError: different lasers or image sizes, or no common standoffs.
    """
    sensor_a, sensor_b = CalibratedSensor(a), CalibratedSensor(b)
    pairs = _visible(sensor_a, sensor_b, _common_ranges(a, b))
    shift_px = _spots(sensor_b, pairs) - _spots(sensor_a, pairs)
    whiten = _whitener(_spot_covariance(sensor_a, pairs) + _spot_covariance(sensor_b, pairs))
    white = whiten @ shift_px
    chi2 = float(white @ white)
    probability = float(chi2_sf(chi2, len(white)))
    moved = probability < SIGNIFICANCE
    identical = _numbers(a) == _numbers(b)
    return Comparison(
        differences=_differences(sensor_a, sensor_b, pairs),
        chi2=chi2,
        degrees_of_freedom=len(white),
        probability=probability,
        moved=moved,
        explanations=_explanations(sensor_a, b, pairs, whiten) if moved else (),
        identical=identical,
        notes=(*_other_sensor(a, b), *_reservations(a, b, identical)),
    )


def _other_sensor(a: Calibration, b: Calibration) -> list[str]:
    """Signs that the calibrations are of two sensors."""
    of_a, of_b = a.laser_ranger.provenance, b.laser_ranger.provenance
    return [
        f"{what} differ: A is of {name_a}, B of {name_b}. The test assumes one sensor; check that both files"
        " belong to it"
        for what, name_a, name_b in (
            ("rigs", of_a.rig, of_b.rig),
            ("serial numbers", of_a.serial, of_b.serial),
        )
        if name_a != name_b
    ]


def _reservations(a: Calibration, b: Calibration, identical: bool) -> list[str]:
    """Common captures, and limits that failed."""
    notes = []
    of_a, of_b = a.laser_ranger, b.laser_ranger
    if of_a.provenance.captures_sha256 == of_b.provenance.captures_sha256 and not identical:
        notes.append(
            "both calibrations use the same captures; the test assumes independent ones and is too lenient"
        )
    notes += [
        f"{name} failed its limits and was accepted because: {c.fit.accepted_because or 'no reason given'}"
        for name, c in (("A", of_a), ("B", of_b))
        if c.fit.verdict == "refused"
    ]
    return notes


def _numbers(calibration: Calibration) -> tuple[object, ...]:
    """All numbers that a ranger uses."""
    ours = calibration.laser_ranger
    return calibration.geometry(), ours.lasers, ours.noise, ours.parameters, ours.validity


def _spots(sensor: CalibratedSensor, pairs: RangesByLaser) -> FloatArray:
    """(n,) predicted positions of the spots along each laser's axis, px."""
    return np.concatenate([sensor.spot_px(i, r) @ sensor.axis(i) for i, r in pairs])


def _spot_gradient(sensor: CalibratedSensor, pairs: RangesByLaser) -> FloatArray:
    """(n, P) derivatives of `_spots` by the parameters."""
    gradients = [(sensor.axis(i), sensor.spot_gradient(i, r)) for i, r in pairs]
    return np.concatenate([np.einsum("k,nkp->np", axis, gradient) for axis, gradient in gradients])


def _spot_covariance(sensor: CalibratedSensor, pairs: RangesByLaser) -> FloatArray:
    """(n, n) covariance of `_spots` by that of the calibration, px^2."""
    gradient = _spot_gradient(sensor, pairs)
    return gradient @ sensor.calibration.laser_ranger.parameters.covariance_array @ gradient.T


def _differences(a: CalibratedSensor, b: CalibratedSensor, pairs: RangesByLaser) -> tuple[Difference, ...]:
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
    return np.geomspace(nearest, farthest, RANGES)


def _laser_ids(calibration: Calibration) -> tuple[str, ...]:
    return tuple(laser.id for laser in calibration.laser_ranger.lasers)


def _visible(a: CalibratedSensor, b: CalibratedSensor, grid: FloatArray) -> RangesByLaser:
    """Each laser with the ranges at which both calibrations predict its spot in the image."""
    return [(i, grid[a.in_frame(i, grid) & b.in_frame(i, grid)]) for i in a.ids]


def _whitener(covariance: FloatArray) -> FloatArray:
    """(k, n) transformation of n differences to k independent ones of variance 1."""
    variance, direction = np.linalg.eigh(covariance)
    kept = variance > SMALLEST_VARIANCE * variance[-1]
    return np.asarray((direction[:, kept] / np.sqrt(variance[kept])).T)


def _explanations(
    a: CalibratedSensor, b: Calibration, pairs: RangesByLaser, whiten: FloatArray
) -> tuple[str, ...]:
    """Parameters of B each of which, refitted alone, leaves no significant difference from A."""
    expected = _spots(a, pairs)
    parameters = b.laser_ranger.parameters
    remaining: dict[str, float] = {}
    for column, (name, value) in enumerate(zip(parameters.names, parameters.values, strict=True)):
        if name in b.geometry():
            remaining[name] = _refitted_chi2(b, pairs, whiten, expected, column, value)
    best = min(remaining.values())
    if chi2_sf(best, len(whiten) - 1) < SIGNIFICANCE:
        return ()
    likely = [name for name, chi2 in remaining.items() if chi2 < best + AS_LIKELY_CHI2]
    return tuple(sorted(likely, key=remaining.__getitem__))


def _refitted_chi2(
    b: Calibration, pairs: RangesByLaser, whiten: FloatArray, expected: FloatArray, column: int, value: float
) -> float:
    """Chi-square of the differences with one parameter of B fitted to A, from its `value`."""
    name = b.laser_ranger.parameters.names[column]

    def residual(sensor: CalibratedSensor) -> FloatArray:
        return whiten @ (_spots(sensor, pairs) - expected)

    def linearise(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        sensor = CalibratedSensor(b, {name: float(x[0])})
        return residual(sensor), whiten @ _spot_gradient(sensor, pairs)[:, column : column + 1]

    fitted = gauss_newton(linearise, np.array([value]), GAUSS_NEWTON_STEPS)
    white = residual(CalibratedSensor(b, {name: float(fitted[0])}))
    return float(white @ white)
