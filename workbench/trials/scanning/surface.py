"""Stated surface of a scanned target in plan view, and the deviations of points from it along its normal."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.rig import BenchSpec
from workbench.model.target import CylinderTarget, FlatTarget, Placement, PolynomialTarget
from workbench.trials.reference import standoff_sd_mm

OUTLINE_POINTS = 201


@dataclass(frozen=True)
class Deviations:
    """Deviations of N points, positive where a point is farther from the sensor than the surface."""

    mm: FloatArray
    normal: FloatArray
    """(N, 3) unit normals (x, y, range), away from the sensor."""
    reference_sd_mm: FloatArray
    """(N,) standard uncertainty of the surface along its normal: of standoff, ruler and tilt."""


def deviations(placed: Placement, bench: BenchSpec, position_mm: FloatArray) -> Deviations:
    """Deviations of points (N, 3): x, y, range from the reference plane.

    Raises:
        TypeError: the target has no surface.
    """
    target = placed.target
    value, gradient = _implicit(placed, bench, position_mm)
    length = np.linalg.norm(gradient, axis=1)
    normal = gradient / length[:, None]
    along = hypot(standoff_sd_mm(placed, bench), bench.ruler_scale.sd * placed.standoff_mm) * normal[:, 2]
    tilt = np.zeros(len(position_mm))
    if isinstance(target, FlatTarget):
        # z = standoff + x tan(yaw) + y tan(pitch); d tan(a) = (1 + tan^2 a) da.
        by_angle = position_mm[:, :2] * (1.0 + gradient[:, :2] ** 2)
        sds_deg = [bench.tilt_sd_deg if own_deg is None else own_deg for own_deg in target.turn_sds_deg]
        sds = np.radians(np.hypot(sds_deg, bench.target_tilt_sd_deg))
        tilt = np.linalg.norm(by_angle * sds, axis=1) * normal[:, 2]
    return Deviations(value / length, normal, np.hypot(along, tilt))


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
