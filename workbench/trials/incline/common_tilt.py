"""Common tilt of the target's mount, from inclines on the mount of the calibration.

A calibration on a mount with the tilt t, estimated as c, has absorbed the error c - t. Its lasers range a
plane of the slope m as one of the slope m + c - t. A target set to the angle a stands at a + t. Its slope is
seen as tan(a + t) + c - t, and the error of its angle is to first order

    t sin^2(a) + c cos^2(a).

At a = 0 this is c: a flat target shows what the calibration knows already, except that its set angle may be
better than the tilts of the calibration's placements. Towards 90 deg it is t: inclines on the same mount
determine the tilt, 60 deg some three times better than 30. An error of scale is odd in a, so that the two
sides separate it. On another mount, with the tilt t', the error is t' + (c - t) cos^2(a). It contains nothing
on t that t' does not hide.

The estimate is the mean of t given the ranges of all lasers, from the joint Gaussian of the calibration's
parameters and its tilt. The distance of every set-up is free. An angle is set and measured once, then the
target is placed at each range: the error of an angle is common to its ranges, independent of other angles.
The tilt of a placement about the other axis is independent. The estimate contains the information of the
calibration: it is a prior for new captures, not for those of the calibration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, ceil, degrees, radians

import numpy as np
from scipy.linalg import block_diag

from workbench.model.arrays import FloatArray
from workbench.model.rig import TARGET_TILT, BenchSpec
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.target_check import Points
from workbench.trials.targets import InclineSpec

FREE_SD_MM = 1e4
"""1 sigma of the distance of a set-up, which is not used."""
LEAST_GAIN = 0.8
"""Largest ratio of the new to the old deviation with which a tilt counts as measured."""


@dataclass(frozen=True)
class InclinePoints:
    """Ranges of the lasers on one incline."""

    target: InclineSpec
    points: Points


@dataclass(frozen=True)
class CommonTilt:
    """Tilt about one axis, common to all placements, 1 sigma."""

    axis: str
    tilt_deg: float
    sd_deg: float
    known_sd_deg: float
    """1 sigma by the calibration alone."""

    @property
    def rig_keys(self) -> str:
        """Keys of `bench` in the rig file of the next calibration; empty where nothing was added."""
        key = "target_yaw_deg" if self.axis == "vertical" else "target_pitch_deg"
        # Rounded up: 0 would state an exactly known tilt.
        values = f"{key}: {self.tilt_deg:.3f}, target_tilt_sd_deg: {ceil(1000 * self.sd_deg) / 1000:.3f}"
        return values if self.is_measured else ""

    @property
    def is_measured(self) -> bool:
        """Whether the inclines add to what the calibration knows."""
        return self.sd_deg < LEAST_GAIN * self.known_sd_deg


def common_tilts(
    sensor: CalibratedSensor, set_ups: Sequence[InclinePoints], bench: BenchSpec
) -> list[CommonTilt]:
    """Tilts about the axes of the inclines; empty where the calibration does not state its own.

    Args:
        sensor: the calibrated sensor.
        set_ups: inclines on the mount of the calibration.
        bench: bench, with the tilt of one placement.
    """
    names = sensor.calibration.laser_ranger.parameters.names
    if not set(TARGET_TILT) <= set(names):
        return []
    parts = [_at_set_up(sensor, one, bench) for one in set_ups]
    errors, gradient, by_angle = (np.concatenate([part[k] for part in parts]) for k in (0, 1, 2))
    covariance = gradient @ sensor.covariance @ gradient.T + block_diag(*(part[3] for part in parts))
    angle = np.repeat([_angle_index(set_ups, one) for one in set_ups], [len(part[0]) for part in parts])
    covariance += np.where(angle[:, None] == angle, np.outer(by_angle, by_angle), 0.0)
    found = []
    for axis, name in zip(("vertical", "horizontal"), TARGET_TILT, strict=True):
        index = names.index(name)
        if not sensor.covariance[index, index] or axis not in {one.target.axis for one in set_ups}:
            continue
        shared = gradient @ sensor.covariance[:, index]
        weight = np.linalg.solve(covariance, shared)
        known = sensor.calibration.laser_ranger.parameters.values[index]
        variance = sensor.covariance[index, index]
        slope, left = known + float(weight @ errors), max(float(variance - weight @ shared), 0.0)
        to_deg = degrees(1.0 / (1.0 + slope**2))
        found.append(
            CommonTilt(axis, degrees(atan(slope)), to_deg * left**0.5, to_deg * float(variance) ** 0.5)
        )
    return found


def _angle_index(set_ups: Sequence[InclinePoints], one: InclinePoints) -> int:
    """Index of the first set-up with the same angle, whose error all its ranges share."""
    turns = [(other.target.axis, other.target.angle_deg) for other in set_ups]
    return turns.index((one.target.axis, one.target.angle_deg))


def _at_set_up(
    sensor: CalibratedSensor, one: InclinePoints, bench: BenchSpec
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """One target at one range, n lasers.

    Returns:
        Errors (n,) of the ranges, and their derivatives (n, P) by the parameters. Their change (n,) by one
        standard uncertainty of the angle. Covariance (n, n) of everything else at this set-up.
    """
    parameters, points = sensor.calibration.laser_ranger.parameters, one.points
    columns = [parameters.names.index(name) for name in TARGET_TILT]
    angle_deg = one.target.angle_deg
    turned = np.array([angle_deg, 0.0] if one.target.axis == "vertical" else [0.0, angle_deg])
    common = np.array([parameters.values[column] for column in columns])
    angles = np.radians(turned) + np.arctan(common)
    slopes, lever = np.tan(angles), points.place_mm / np.cos(angles) ** 2
    expected = points.place_mm @ slopes
    errors = points.range_mm - expected
    gradient = np.einsum("k,nkp->np", slopes, points.place_by_parameter) - points.by_parameter
    gradient[:, columns] += lever / (1.0 + common**2)
    about = 0 if one.target.axis == "vertical" else 1
    by_tilt = lever[:, 1 - about] * radians(bench.tilt_sd_deg)
    own = np.diag((points.spot_sd_mm * (1.0 - points.tangent @ slopes)) ** 2) + FREE_SD_MM**2
    own += np.outer(by_tilt, by_tilt)
    by_angle = lever[:, about] * radians(one.target.reference_sd_deg)
    # The distance is free: only differences of the ranges count.
    return errors - errors.mean(), gradient, by_angle, own
