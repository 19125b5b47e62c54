"""Check that the target in front of the sensor is the one that was asked for, from the readings themselves.

The ranges of the lasers are compared with the shape of the target asked for, at any distance: a wrong
standoff is an error of the range, not another target. If they disagree, a plane at any angle is tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, hypot, radians, sqrt, tan

import numpy as np
from scipy.stats import chi2

from workbench.model.arrays import FloatArray
from workbench.model.event import ReadingTaken
from workbench.model.number_text import probability
from workbench.model.rig import BenchSpec
from workbench.model.target import CylinderTarget, FlatTarget, Placement
from workbench.sensor.calibrated import CalibratedSensor, X, Y

ALARM = 1e-4
"""P value below which the readings contradict the target asked for; a trial has some ten placements."""
PLANE_ALARM = 0.01
"""P value of a plane below which the target is not called flat."""
LEAST_SPREAD = 0.3
"""Smallest extent of the spots along an axis, relative to the other one, from which an angle is measured."""
ASIDE_SD_MM = 2.0
"""Standard uncertainty of the position of a cylinder's axis across the beams."""
REFINEMENTS = 3
"""Repetitions of the fit of a plane: its covariance depends on its slopes."""


@dataclass(frozen=True)
class Points:
    """Mean ranges of n lasers at one placement, and the positions of their spots."""

    range_mm: FloatArray
    """(n,)"""
    place_mm: FloatArray
    """(n, 2) x and y."""
    by_parameter: FloatArray
    """(n, P) derivatives of the ranges."""
    place_by_parameter: FloatArray
    """(n, 2, P) derivatives of the positions."""
    tangent: FloatArray
    """(n, 2) derivatives of the positions by the range."""
    spot_sd_mm: FloatArray
    """(n,) 1 sigma of the ranges by noise and speckle."""
    parameter_covariance: FloatArray
    """(P, P)"""

    @classmethod
    def of(cls, sensor: CalibratedSensor, readings: Sequence[ReadingTaken]) -> Points | None:
        """Means over the readings at one placement; None with fewer than two lasers."""
        px = {
            i: [(r.u_px, r.v_px) for one in readings for r in one.lasers if r.laser_id == i]
            for i in sensor.ids
        }
        ids = [i for i in sensor.ids if px[i]]
        if len(ids) < 2:
            return None
        noise_px = sensor.calibration.laser_ranger.noise.spot_sd_px
        position = np.array([np.array(px[i], np.float64).mean(axis=0) for i in ids])
        sd = np.array([[noise_px / sqrt(len(px[i]))] * 2 for i in ids])
        ranges = sensor.ranges(ids, position, sd)
        along = [sensor.places(ids, axis, ranges) for axis in (X, Y)]
        return cls(
            ranges.range_mm,
            np.stack([place for place, _, _ in along], axis=1),
            ranges.by_parameter,
            np.stack([by for _, by, _ in along], axis=1),
            np.stack([tangent for _, _, tangent in along], axis=1),
            ranges.spot_sd_mm,
            sensor.covariance,
        )

    def covariance(self, slopes: FloatArray) -> FloatArray:
        """(n, n) covariance of range - surface(x, y) for a surface of the slopes (n, 2) at the spots, mm2."""
        gradient = self.by_parameter - np.einsum("nk,nkp->np", slopes, self.place_by_parameter)
        own = self.spot_sd_mm * (1.0 - (slopes * self.tangent).sum(axis=1))
        return np.asarray(gradient @ self.parameter_covariance @ gradient.T + np.diag(own**2), np.float64)


@dataclass(frozen=True)
class Surface:
    """Surface asked for: depths (n,) relative to the standoff, slopes (n, 2), and covariance (n, n), mm."""

    depth_mm: FloatArray
    slopes: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class Plane:
    """Plane through the ranges at any distance and angle."""

    angles_deg: tuple[float, float]
    """About the vertical and the horizontal axis; 0 where the spots do not extend."""
    sd_deg: tuple[float, float]
    probability: float | None
    """P value of the residuals; None without degrees of freedom."""


def other_target(
    sensor: CalibratedSensor, readings: Sequence[ReadingTaken], placement: Placement, bench: BenchSpec
) -> str:
    """Description of a target that is not the one asked for; empty where the readings agree with it.

    Args:
        sensor: the calibrated sensor.
        readings: readings at the placement.
        placement: placement asked for, with its target.
        bench: bench, with the uncertainties of tilts.
    """
    points = Points.of(sensor, readings)
    surface = None if points is None else _asked_for(points, placement, bench)
    if points is None or surface is None:
        return ""
    covariance = points.covariance(surface.slopes) + surface.covariance
    p = _probability(points.range_mm - surface.depth_mm, np.ones((len(points.range_mm), 1)), covariance)
    if p is None or p >= ALARM:
        return ""
    return f"the readings show {_found(points, readings)}, not {_name(placement)} ({probability(p)})"


def fit_plane(points: Points) -> Plane:
    """Plane by generalised least squares, about each axis along which the spots extend."""
    place = points.place_mm
    spread = np.ptp(place, axis=0)
    wide = [k for k in (0, 1) if spread[k] >= LEAST_SPREAD * spread.max()]
    design = np.column_stack([np.ones(len(place)), *(place[:, k] for k in wide)])
    slopes = np.zeros(2)
    for _ in range(REFINEMENTS):
        covariance = points.covariance(np.broadcast_to(slopes, place.shape))
        weight = np.linalg.pinv(covariance)
        of_fit = np.linalg.pinv(design.T @ weight @ design)
        solution = of_fit @ design.T @ weight @ points.range_mm
        slopes[wide] = solution[1:]
    sd = np.zeros(2)
    sd[wide] = np.sqrt(np.diag(of_fit))[1:] / (1.0 + slopes[wide] ** 2)
    angles = np.degrees(np.arctan(slopes))
    return Plane(
        (float(angles[0]), float(angles[1])),
        (degrees(sd[0]), degrees(sd[1])),
        _probability(points.range_mm, design, covariance),
    )


def _asked_for(points: Points, placement: Placement, bench: BenchSpec) -> Surface | None:
    """Surface of the target; None for one that cannot be compared."""
    target, place = placement.target, points.place_mm
    tilt_sd = radians(hypot(bench.tilt_sd_deg, bench.target_tilt_sd_deg))
    if isinstance(target, FlatTarget):
        angles = (target.yaw_deg + bench.target_yaw_deg, target.pitch_deg + bench.target_pitch_deg)
        slopes = np.broadcast_to([tan(radians(angle)) for angle in angles], place.shape)
        lever = place / np.array([cos(radians(angle)) ** 2 for angle in angles])
        return Surface((slopes * place).sum(axis=1), slopes, tilt_sd**2 * lever @ lever.T)
    if isinstance(target, CylinderTarget):
        radius_mm, aside = target.diameter_mm / 2, place[:, 0] - target.shift_mm
        if (np.abs(aside) >= radius_mm).any():
            return None
        rest = np.sqrt(radius_mm**2 - aside**2)
        slopes = np.column_stack([aside / rest, np.zeros(len(aside))])
        by_radius = 1.0 - radius_mm / rest
        radius_sd_mm = (target.diameter_sd_mm or 0.0) / 2
        covariance = ASIDE_SD_MM**2 * np.outer(slopes[:, 0], slopes[:, 0])
        covariance += radius_sd_mm**2 * np.outer(by_radius, by_radius)
        return Surface(radius_mm - rest, slopes, covariance)
    return None


def _probability(values: FloatArray, design: FloatArray, covariance: FloatArray) -> float | None:
    """P value of the residuals of a generalised least-squares fit; None without degrees of freedom."""
    freedom = len(values) - design.shape[1]
    if freedom < 1:
        return None
    weight = np.linalg.pinv(covariance)
    solution = np.linalg.pinv(design.T @ weight @ design) @ design.T @ weight @ values
    residuals = values - design @ solution
    return float(chi2.sf(residuals @ weight @ residuals, freedom))


def _found(points: Points, readings: Sequence[ReadingTaken]) -> str:
    plane = fit_plane(points)
    if plane.probability is None or plane.probability >= PLANE_ALARM:
        turns = [
            f"{angle:+.1f} +- {sd:.1f} deg about the {axis} axis"
            for angle, sd, axis in zip(
                plane.angles_deg, plane.sd_deg, ("vertical", "horizontal"), strict=True
            )
            if sd > 0
        ]
        return f"a flat target at {' and '.join(turns)}"
    radii = [one.radius_mm for one in readings if one.radius_mm is not None]
    if radii:
        return f"a curved target, radius {float(np.mean(radii)):.4g} mm"
    return "a target of another shape (or the sensor has changed)"


def _name(placement: Placement) -> str:
    target = placement.target
    if isinstance(target, CylinderTarget):
        return f"a cylinder of {target.diameter_mm:g} mm diameter"
    turned = (getattr(target, "yaw_deg", 0.0), getattr(target, "pitch_deg", 0.0))
    if turned == (0.0, 0.0):
        return "a flat target square to the axis"
    axis = "vertical" if abs(turned[0]) >= abs(turned[1]) else "horizontal"
    return f"a flat target at {max(turned, key=abs):+g} deg about the {axis} axis"
