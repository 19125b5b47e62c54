"""The ranges of `workbench.sensor.calibrated.CalibratedSensor`, for many calibrations at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.calibration.model.layout import Layout
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.optics.lens import LensModel
from workbench.optics.rays import Ray
from workbench.optics.triangulate import MeasuredSpot, estimate_depth


@dataclass(frozen=True)
class Ranged:
    """Ranges (N, K, L) in mm, 1 sigma, as their calibrations state them."""

    range_mm: FloatArray
    sd_mm: FloatArray
    spot_sd_mm: FloatArray
    gradient: FloatArray
    """(N, K, L, S) derivatives by the sensor's parameters."""

    def flat(self, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, K) range of a flat from all lasers, as the ranger weights them, and its sd."""
        weight = np.where(np.isfinite(self.range_mm), 1.0 / self.spot_sd_mm**2, 0.0)
        weight /= weight.sum(axis=-1, keepdims=True)
        mean = (weight * np.where(weight > 0, self.range_mm, 0.0)).sum(axis=-1)
        gradient = np.where(weight[..., None] > 0, self.gradient, 0.0)
        gradient = (weight[..., None] * gradient).sum(axis=2)
        shared = np.einsum("nks,nst,nkt->nk", gradient, covariance, gradient, optimize=True)
        own = (weight * np.where(weight > 0, self.spot_sd_mm, 0.0)) ** 2
        return np.asarray(mean), np.sqrt(shared + own.sum(axis=-1))


def ranges(
    rig: Rig, sensor: FloatArray, covariance: FloatArray, position_px: FloatArray, sd_px: FloatArray
) -> Ranged:
    """Range the spots of N sensors.

    Args:
        rig: kind of lens.
        sensor: (N, S) fitted values.
        covariance: (N, S, S) of them.
        position_px: (N, K, L, 2); NaN where not seen: the range is NaN.
        sd_px: (N,) 1 sigma of a spot in either coordinate, speckle included.
    """
    seen = np.asarray(np.isfinite(position_px).all(axis=-1))
    layout = Layout(rig.camera.lens, len(rig.lasers))
    rays = sensor[:, layout.rays].reshape(len(sensor), layout.lasers, -1)
    position = np.where(seen[..., None], position_px, 0.0)
    found = _depths(layout.model, sensor[:, layout.lens], rays, position, sd_px)
    w, spot_sd, by_lens, by_ray = (np.asarray(part) for part in found)
    with np.errstate(divide="ignore"):
        range_mm = np.where(w > 0, 1.0 / w, np.inf) - sensor[:, layout.offset, None, None]
    gradient = np.zeros((*w.shape, sensor.shape[1]))
    gradient[..., layout.lens], gradient[..., layout.offset] = by_lens, -1.0
    for laser in range(w.shape[2]):
        gradient[:, :, laser, layout.ray(laser)] = by_ray[:, :, laser]
    shared = np.einsum("nkls,nst,nklt->nkl", gradient, covariance, gradient, optimize=True)
    sd = np.where(seen, np.sqrt(shared + spot_sd**2), np.nan)
    return Ranged(np.where(seen, range_mm, np.nan), sd, spot_sd, gradient)


@partial(jax.jit, static_argnums=0)
def _depths(
    model: LensModel, lens: Array, rays: Array, position_px: Array, sd_px: Array
) -> tuple[Array, ...]:
    def one(lens: Array, ray: Array, position: Array, sd: Array) -> tuple[Array, ...]:
        found = estimate_depth(model, lens, Ray(*ray), MeasuredSpot(position[0], position[1], sd, sd))
        return found.inverse_depth_per_mm, found.z_sd_of_spot_mm, found.dz_dlens, found.dz_dray

    by_laser = jax.vmap(one, in_axes=(None, 0, 0, None))
    by_range = jax.vmap(by_laser, in_axes=(None, None, 0, None))
    return tuple(jnp.asarray(part) for part in jax.vmap(by_range)(lens, rays, position_px, sd_px))
