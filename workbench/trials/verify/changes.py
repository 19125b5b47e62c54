"""Changes of a sensor since its calibration that explain the errors of its lasers, each alone.

The errors e of n laser ranges have the covariance V by calibration, spots, placements and tilts. A change of
parameters moves them along the columns of D. Its amount by generalised least squares is F D' V^-1 e, with
F = (D' V^-1 D)^-1. It lowers chi-square by e' V^-1 D F D' V^-1 e. Changes whose gains are alike cannot be
distinguished. Errors are those of inverse depths, in which a large change is linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, log, radians

import numpy as np
from scipy.stats import chi2

from workbench.model.arrays import FloatArray
from workbench.model.rig import BenchSpec
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.statistics import Change, PlacementCheck

ALIKE = 2.0 * log(20.0)
"""Largest difference of the gains of two changes that are not distinguished: odds of 20 to 1."""
LEAST_GAIN = 10.0
"""Smallest gain of a change that is named; by chance 1 of 600 for each of some ten changes."""
PENALTY = 4.0
"""Gain that a second parameter must add: some log(n) of n errors."""
UNEXPLAINED = 1e-3
"""P value of the remaining errors below which no single change explains them."""
MRAD = 1e3


@dataclass(frozen=True)
class _Candidate:
    name: str
    parameters: tuple[str, ...]
    """The first one is displayed."""
    scale: float
    """Displayed amount / change of the first parameter."""
    unit: str


def changes(sensor: CalibratedSensor, checks: Sequence[PlacementCheck], bench: BenchSpec) -> list[Change]:
    """Every possible change, best supported first; empty without a laser.

    Args:
        sensor: the calibrated sensor.
        checks: placements of the target; their distances may be unknown.
        bench: bench, with the uncertainties of tilts.
    """
    used = [check for check in checks if check.points is not None]
    if not used:
        return []
    errors, gradient, covariance = _errors(sensor, used, bench)
    weight = np.linalg.pinv(covariance)
    total = float(errors @ weight @ errors)
    names = sensor.calibration.laser_ranger.parameters.names
    found = []
    for one in _candidates(sensor):
        columns = -gradient[:, [names.index(name) for name in one.parameters]]
        if not np.abs(columns).sum(axis=0).all():
            continue
        of_change = np.linalg.pinv(columns.T @ weight @ columns)
        amount = of_change @ columns.T @ weight @ errors
        gain = float(errors @ weight @ columns @ amount)
        remaining = float(chi2.sf(total - gain, max(len(errors) - len(amount), 1)))
        found.append(
            Change(
                one.name,
                one.parameters,
                one.scale * float(amount[0]),
                one.scale * float(np.sqrt(of_change[0, 0])),
                one.unit,
                gain - PENALTY * (len(amount) - 1),
                remaining,
            )
        )
    return sorted(found, key=lambda change: -change.gain)


def named(found: Sequence[Change]) -> str:
    """Most probable changes in words; empty if none is supported, or none explains the errors."""
    if not found or found[0].gain < LEAST_GAIN:
        return ""
    alike = [one for one in found if found[0].gain - one.gain < ALIKE]
    if all(one.remaining_p < UNEXPLAINED for one in alike):
        return "no single change of the sensor explains the errors"
    simplest = [one for one in alike if not any(set(each.parameters) < set(one.parameters) for each in alike)]
    return "probably " + ", or ".join(one.text for one in simplest)


def _errors(
    sensor: CalibratedSensor, checks: Sequence[PlacementCheck], bench: BenchSpec
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors (n,) of all lasers at all placements, derivatives (n, P) and covariance (n, n); mm.

    Errors of inverse depths are multiplied by the squared true depth, so that they are in mm.
    """
    tilt_sd = radians(hypot(bench.tilt_sd_deg, bench.target_tilt_sd_deg))
    errors, gradients, owns = [], [], []
    for check in checks:
        points = check.points
        assert points is not None  # noqa: S101 - the caller has selected these placements
        count = len(points.range_mm)
        depth_mm = points.range_mm + sensor.offset_mm
        ratio = (check.standoff_mm + sensor.offset_mm) / depth_mm
        errors.append(ratio * (points.range_mm - check.standoff_mm))
        gradients.append(ratio[:, None] ** 2 * points.by_parameter)
        own = np.diag((ratio**2 * points.spot_sd_mm) ** 2) + check.reference_sd_mm**2 * np.ones(
            (count, count)
        )
        owns.append(own + tilt_sd**2 * points.place_mm @ points.place_mm.T)
    gradient = np.concatenate(gradients)
    covariance = gradient @ sensor.covariance @ gradient.T
    start = 0
    for own in owns:
        end = start + len(own)
        covariance[start:end, start:end] += own
        start = end
    return np.concatenate(errors), gradient, covariance


def _candidates(sensor: CalibratedSensor) -> list[_Candidate]:
    f_px = sensor.calibration.geometry()["f_px"]
    found = [
        _Candidate("focal length changed", ("f_px",), 100.0 / f_px, "%"),
        _Candidate("lens refocused, focal length changed", ("f_px", "offset_mm"), 100.0 / f_px, "%"),
        _Candidate("pinhole displaced along the axis", ("offset_mm",), 1.0, "mm"),
        _Candidate("camera turned about the vertical", ("cx_px",), MRAD / f_px, "mrad"),
        _Candidate("camera turned about the horizontal", ("cy_px",), MRAD / f_px, "mrad"),
    ]
    for laser in sensor.calibration.laser_ranger.lasers:
        turn, origin = ("tx", "x_mm") if laser.axis == "u" else ("ty", "y_mm")
        found.append(_Candidate(f"{laser.id} turned", (f"{laser.id}.{turn}",), MRAD, "mrad"))
        found.append(_Candidate(f"{laser.id} displaced", (f"{laser.id}.{origin}",), 1.0, "mm"))
    return found
