"""Stated surface of a scanned target in plan view, and the deviations of points from it along its normal."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.rig import TARGET_TILT, BenchSpec
from workbench.model.target import CylinderTarget, FlatTarget, Placement, PolynomialTarget
from workbench.sensor.scanning import ScanPoints
from workbench.trials.reference import standoff_sd_mm

OUTLINE_POINTS = 201
SHARED = ("ruler_scale", *TARGET_TILT)
"""Parameters of the bench that calibration and stated surface share: ruler, and tilt of all flats."""


@dataclass(frozen=True)
class Deviations:
    """Deviations of N points, positive where a point is farther from the sensor than the surface."""

    mm: FloatArray
    normal: FloatArray
    """(N, 3) unit normals (x, y, range), away from the sensor."""
    own_sd_mm: FloatArray
    """(N,) standard uncertainty of the surface along its normal, of this placement: of its position, tilt and
    diameter."""
    by_shared: FloatArray
    """(N, 3) derivatives of the surface along its normal by SHARED."""
    shared_sd: FloatArray
    """(3,) standard deviations of SHARED before the calibration."""

    @property
    def reference_sd_mm(self) -> FloatArray:
        """(N,) standard uncertainty of the surface along its normal."""
        shared_mm = np.linalg.norm(self.by_shared * self.shared_sd, axis=1)
        return np.asarray(np.hypot(self.own_sd_mm, shared_mm))

    def sd_mm(self, points: ScanPoints, shared_covariance: FloatArray) -> FloatArray:
        """(N,) standard uncertainties of the deviations: of point and surface, which share errors.

        With p the calibration's parameters and s those of SHARED: the error of an estimate is independent of
        the estimates. So the covariance of (estimate of p) - p with s is minus that of p and s in the
        posterior.

        Args:
            points: N points.
            shared_covariance: (3, P) covariance of SHARED and the parameters in the posterior.
        """
        of_point = np.einsum("ni,nij,nj->n", self.normal, points.covariance_mm2, self.normal)
        by_parameter = np.einsum("ni,nip->np", self.normal, points.common)
        common = np.einsum("nk,kp,np->n", self.by_shared, shared_covariance, by_parameter)
        return np.asarray(np.sqrt(of_point + self.reference_sd_mm**2 - 2.0 * common))


def deviations(placed: Placement, bench: BenchSpec, position_mm: FloatArray) -> Deviations:
    """Deviations of points (N, 3): x, y, range from the reference plane.

    A cylinder or a polynomial is placed along x as accurately as along z. A larger diameter, at the same
    standoff, moves the side of a cylinder outwards by half of that times 1 - n_z, with n the normal.

    Raises:
        TypeError: the target has no surface.
    """
    target = placed.target
    value, gradient = _implicit(placed, bench, position_mm)
    length = np.linalg.norm(gradient, axis=1)
    normal = gradient / length[:, None]
    placement_sd_mm = standoff_sd_mm(placed, bench)
    by_shared = np.zeros((len(position_mm), len(SHARED)))
    by_shared[:, 0] = placed.standoff_mm * normal[:, 2]
    if isinstance(target, FlatTarget):
        # z = standoff + x tan(yaw) + y tan(pitch); d tan(a) = (1 + tan^2 a) da.
        by_angle = position_mm[:, :2] * (1.0 + gradient[:, :2] ** 2) * normal[:, 2:]
        sds_deg = [bench.tilt_sd_deg if own_deg is None else own_deg for own_deg in target.turn_sds_deg]
        own = np.hypot(placement_sd_mm * normal[:, 2], np.linalg.norm(by_angle * np.radians(sds_deg), axis=1))
        common = np.array([bench.target_slope_x.value, bench.target_slope_y.value])
        by_shared[:, 1:] = by_angle / (1.0 + common**2)
    else:
        own = placement_sd_mm * np.hypot(normal[:, 0], normal[:, 2])
        if isinstance(target, CylinderTarget):
            own = np.hypot(own, (target.diameter_sd_mm or 0.0) / 2 * (1.0 - normal[:, 2]))
    shared_sd = np.array([bench.ruler_scale.sd, bench.target_slope_x.sd, bench.target_slope_y.sd])
    return Deviations(value / length, normal, own, by_shared, shared_sd)


def outline(placed: Placement, bench: BenchSpec, x_mm: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """X and range of the surface at the height of the optical axis, between two x as far as it reaches."""
    x = np.linspace(*x_mm, OUTLINE_POINTS)
    target, standoff_mm = placed.target, _standoff_mm(placed, bench)
    if isinstance(target, CylinderTarget):
        radius = target.diameter_mm / 2
        x = x[np.abs(x - target.shift_mm) < radius]
        return x, standoff_mm + radius - np.sqrt(radius**2 - (x - target.shift_mm) ** 2)
    zero = np.zeros_like(x)
    value, _ = _implicit(placed, bench, np.column_stack([x, zero, zero]))
    return x, -value


def _standoff_mm(placed: Placement, bench: BenchSpec) -> float:
    return placed.standoff_mm * (1.0 + bench.ruler_scale.value)


def _implicit(placed: Placement, bench: BenchSpec, position_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A function that is 0 on the surface and positive behind it (N,), and its gradient (N, 3)."""
    x, y, z = position_mm.T
    target, standoff_mm = placed.target, _standoff_mm(placed, bench)
    one, zero = np.ones_like(x), np.zeros_like(x)
    if isinstance(target, FlatTarget):
        slope_x, slope_y = (
            tan(radians(own_deg + common_deg))
            for own_deg, common_deg in (
                (target.yaw_deg, bench.target_yaw_deg),
                (target.pitch_deg, bench.target_pitch_deg),
            )
        )
        return z - standoff_mm - slope_x * x - slope_y * y, np.column_stack(
            [-slope_x * one, -slope_y * one, one]
        )
    if isinstance(target, CylinderTarget):
        radius = target.diameter_mm / 2
        aside, behind = x - target.shift_mm, z - standoff_mm - radius
        distance = np.hypot(aside, behind)
        return radius - distance, np.column_stack([-aside / distance, zero, -behind / distance])
    if isinstance(target, PolynomialTarget):
        curve = np.polynomial.Polynomial([standoff_mm, *target.coefficients])
        aside = x - target.shift_mm
        return z - curve(aside), np.column_stack([-curve.deriv()(aside), zero, one])
    raise TypeError(f"expected a flat, a cylinder or a polynomial, got {target.shape}")
