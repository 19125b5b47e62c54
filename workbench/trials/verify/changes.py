"""Changes of a sensor since its calibration that explain the errors of its lasers, each alone.

A change of parameters moves the whitened scores s along the columns of D. Its amount by least squares is
F D' s, with F = (D' D)^-1. It lowers chi-square by its gain, s' D F D' s. With a valid calibration the gain
has a chi-square distribution of as many degrees of freedom as the change has parameters. No test that does
not depend on the amount is more powerful. Changes whose gains are alike cannot be distinguished.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from workbench.model.stats import chi2_sf
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.laser_errors import LaserErrors

ALIKE = 2.0 * log(20.0)
"""Largest difference of the gains of two changes that are not distinguished: odds of 20 to 1."""
LEAST_GAIN = 10.0
"""Smallest gain of a change that is named; by chance 1 of 600 for each of some ten changes."""
PENALTY = 4.0
"""Gain that a second parameter must add: some log(n) of n errors."""
UNEXPLAINED = 1e-3
"""P value of the remaining errors below which no single change explains them."""
FOCAL_LENGTH, REFOCUSED = ("f_px",), ("f_px", "offset_mm")
MRAD = 1e3


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
    p: float
    """P value of the errors of a valid calibration against this change."""
    remaining_p: float
    """P value of the errors that the change leaves."""

    @property
    def text(self) -> str:
        """Change with its amount."""
        return f"{self.name} by {self.amount:+.2g} +- {self.sd:.1g} {self.unit}"


@dataclass(frozen=True)
class _Candidate:
    name: str
    parameters: tuple[str, ...]
    """The first one is displayed."""
    scale: float
    """Displayed amount / change of the first parameter."""
    unit: str


def changes(sensor: CalibratedSensor, errors: LaserErrors | None) -> list[Change]:
    """Every possible change that moves a range, best supported first; empty without errors."""
    if errors is None:
        return []
    names = sensor.calibration.laser_ranger.parameters.names
    found = []
    for one in _candidates(sensor):
        columns = errors.by_parameter[:, [names.index(name) for name in one.parameters]]
        if not np.abs(columns).sum(axis=0).all():
            continue
        of_change = np.linalg.pinv(columns.T @ columns)
        along = columns.T @ errors.scores
        amount = of_change @ along
        gain, count = float(along @ amount), len(amount)
        found.append(
            Change(
                one.name,
                one.parameters,
                one.scale * float(amount[0]),
                one.scale * float(np.sqrt(of_change[0, 0])),
                one.unit,
                gain - PENALTY * (count - 1),
                float(chi2_sf(gain, count)),
                float(chi2_sf(max(errors.chi2 - gain, 0.0), max(len(errors.scores) - count, 1))),
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


def _candidates(sensor: CalibratedSensor) -> list[_Candidate]:
    f_px = sensor.calibration.geometry()["f_px"]
    found = [
        _Candidate("focal length changed", FOCAL_LENGTH, 100.0 / f_px, "%"),
        _Candidate("lens refocused, focal length changed", REFOCUSED, 100.0 / f_px, "%"),
        _Candidate("pinhole displaced along the axis", ("offset_mm",), 1.0, "mm"),
        _Candidate("camera turned about the vertical", ("cx_px",), MRAD / f_px, "mrad"),
        _Candidate("camera turned about the horizontal", ("cy_px",), MRAD / f_px, "mrad"),
    ]
    for laser in sensor.calibration.laser_ranger.lasers:
        along = int(np.abs(sensor.axis(laser.id)).argmax())
        turn, origin = ("tx", "ty")[along], ("x_mm", "y_mm")[along]
        found.append(_Candidate(f"{laser.id} turned", (f"{laser.id}.{turn}",), MRAD, "mrad"))
        found.append(_Candidate(f"{laser.id} displaced", (f"{laser.id}.{origin}",), 1.0, "mm"))
    return found
