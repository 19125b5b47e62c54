"""A calibrated scanning head: points of a scan from spots and readings of the encoder, with their covariance.

A point lies on the line of sight of its spot, and on the plane x = x0 + tx z in which the beam lies. With m
the tangent of the sight's angle, and x0 and tx of the turned ray, z = x0 / (m - tx). The row of the spot is
not used; its distance from the beam is a check.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import radians

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.model.arrays import FloatArray
from workbench.model.head_calibration import HeadCalibration
from workbench.model.lens import LensName
from workbench.optics.head import Head, turned_ray
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import Ray
from workbench.optics.undistort import undistort

POINT = ("x_mm", "y_mm", "range_mm")
"""Coordinates of a point: in the camera frame, and from the reference plane."""


@dataclass(frozen=True)
class ScanPoints:
    """N points; NaN where the line of sight does not meet the beam in front of camera and reference plane."""

    position_mm: FloatArray
    """(N, 3) POINT."""
    covariance_mm2: FloatArray
    """(N, 3, 3) of each point: by its spot, its reading and the calibration."""
    common: FloatArray
    """(N, 3, P) derivatives by the parameters of the calibration, which all points share."""
    own_covariance_mm2: FloatArray
    """(N, 3, 3) by spot and reading alone, independent between points."""
    across_sd: FloatArray
    """(N,) distance of the beam from the line of sight, across the scan, in its standard deviations."""

    @property
    def sd_mm(self) -> FloatArray:
        """(N, 3) standard deviations."""
        return np.sqrt(np.diagonal(self.covariance_mm2, axis1=1, axis2=2))


class CalibratedHead:
    """Scanning head of a calibration."""

    def __init__(self, calibration: HeadCalibration) -> None:
        self.calibration = calibration.scanning_head
        self.model = lens_model(self.calibration.distortion_model)
        parameters = self.calibration.parameters
        at = [parameters.names.index(name) for name in self.calibration.names]
        self.values = np.array(parameters.values)[at]
        """(P,) lens, offset, ray and head."""
        self.covariance = parameters.covariance_array[np.ix_(at, at)]
        self._at = at

    @property
    def offset_mm(self) -> float:
        """Distance of the pinhole behind the reference plane."""
        return float(self.values[len(self.model.parameters)])

    def covariance_with(self, names: Sequence[str]) -> FloatArray:
        """(K, P) covariance of K further parameters of the calibration with those of the sensor."""
        parameters = self.calibration.parameters
        return parameters.covariance_array[np.ix_([parameters.names.index(name) for name in names], self._at)]

    def points(self, readings_deg: FloatArray, position_px: FloatArray, sd_px: FloatArray) -> ScanPoints:
        """Points of N spots.

        Args:
            readings_deg: (N,) readings of the encoder.
            position_px: (N, 2) spots.
            sd_px: (N, 2) their deviations, 1 sigma, speckle included.
        """
        count = len(self.model.parameters)
        lens, rest = self.values[:count], self.values[count:]
        readings = np.radians(np.asarray(readings_deg, float))
        ray = turned_ray(Ray(*rest[1:5]), Head(*rest[5:]), readings)
        sight = undistort(self.model, lens, position_px)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.asarray(ray.x_mm) / (sight[:, 0] - np.asarray(ray.tx))
        z = np.where(z > max(self.offset_mm, 0.0), z, np.nan)
        point = np.column_stack([sight * z[:, None], z])
        measured = np.column_stack([position_px, readings])
        found = _derivatives(jnp.asarray(point), measured, self.values, self.calibration.distortion_model)
        by_measured, by_parameter, across_mm = (np.asarray(part) for part in found)
        reading_sd = np.full(len(readings), radians(self.calibration.reading_sd_deg))
        own_sd = np.column_stack([sd_px, reading_sd]) * self.calibration.fit.noise_scale
        scaled = by_measured * own_sd[:, None, :]
        own = scaled @ scaled.transpose(0, 2, 1)
        covariance = own + by_parameter @ self.covariance @ by_parameter.transpose(0, 2, 1)
        position = point - np.array([0.0, 0.0, self.offset_mm])
        return ScanPoints(
            position_mm=position,
            covariance_mm2=covariance[:, :3, :3],
            common=by_parameter[:, :3],
            own_covariance_mm2=own[:, :3, :3],
            across_sd=across_mm / np.sqrt(covariance[:, 3, 3]),
        )


@partial(jax.jit, static_argnames="lens_name")
@partial(jax.vmap, in_axes=(0, 0, None, None))
def _derivatives(
    point: Array, measured: Array, values: Array, lens_name: LensName
) -> tuple[Array, Array, Array]:
    """Derivatives of (x, y, range, across) by spot and reading (4, 3), by the parameters (4, P); across, mm.

    The point X solves F(X, m, p) = 0, so that dX = -(dF/dX)^-1 (dF/dm dm + dF/dp dp).
    """
    model = lens_model(lens_name)
    count = len(model.parameters)

    def ray_of(measured: Array, values: Array) -> Ray:
        return turned_ray(Ray(*values[count + 1 : count + 5]), Head(*values[count + 5 :]), measured[2])

    def miss(point: Array, measured: Array, values: Array) -> Array:
        ray = ray_of(measured, values)
        x, y, z = point
        u, v = model.project(values[:count], x / z, y / z)
        return jnp.array([u - measured[0], v - measured[1], x - ray.x_mm - ray.tx * z])

    def result(point: Array, measured: Array, values: Array) -> Array:
        ray = ray_of(measured, values)
        x, y, z = point
        return jnp.array([x, y, z - values[count], y - ray.y_mm - ray.ty * z])

    of_point, of_measured, of_values = jax.jacfwd(miss, argnums=(0, 1, 2))(point, measured, values)
    by_point, by_measured, by_values = jax.jacfwd(result, argnums=(0, 1, 2))(point, measured, values)
    through = by_point @ jnp.linalg.inv(of_point)
    return (
        by_measured - through @ of_measured,
        by_values - through @ of_values,
        result(point, measured, values)[3],
    )
