"""First-order prediction, before any data: information of spots on parameters, and gradients of ranges.

Parameters are counted in units of their prior sd, so that the prior's information is the unit matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.calibration.estimation.jit_cache import jit_cached
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import PLACEMENT, ParameterTable, sensor_parameters
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.lens import PINHOLE, LensName
from workbench.model.rig import Rig
from workbench.optics.image import in_picture
from workbench.optics.rays import RAY

BLOCK = 4096
"""Number of cells that one call of the compiled program evaluates."""


@dataclass(frozen=True)
class Expectation:
    """First-order prediction of N sensors of one rig."""

    rig: Rig
    sensors: FloatArray
    """(N, S) values of the S parameters, in the order of the table."""

    @property
    def table(self) -> ParameterTable:
        """The S parameters."""
        return ParameterTable(sensor_parameters(self.rig))

    @property
    def cell(self) -> Layout:
        """Layout of the inputs of `predict_cell`."""
        return Layout(self.rig.camera.lens)

    def spot_rows(self, standoff_mm: FloatArray, sd_px: float) -> FloatArray:
        """(N, J, 2 L, S) whitened derivatives of spots on a target at standoffs (J,); 0 outside the image.

        The error of a placement and its tilts are noise that its spots share. Their covariance is
        V = 1 + E E^T = L L^T. The rows are A = L^-1 J; A^T A is the placement's information.

        Args:
            standoff_mm: by the ruler.
            sd_px: 1 sigma of a mean position, in either coordinate.
        """
        _, slopes, seen = self._cells(standoff_mm)
        slopes = slopes * np.where(seen, 1.0 / sd_px, 0.0)[..., None, None]
        tilt = radians(self.rig.bench.tilt_sd_deg)
        error_sd = np.array([self.rig.bench.placement_sd_mm, tilt, tilt])
        shape = (*slopes.shape[:2], slopes.shape[2] * slopes.shape[3])
        by_error = (slopes[..., self.cell.errors] * error_sd).reshape(*shape, len(PLACEMENT))
        noise = np.linalg.cholesky(np.eye(shape[2]) + by_error @ np.swapaxes(by_error, 2, 3))
        by_sensor = self._spread(slopes[..., self.cell.sensor]).reshape(*shape, self.sensors.shape[1])
        return np.asarray(np.linalg.solve(noise, by_sensor), float)

    def range_rows(self, range_mm: FloatArray, sd_px: float) -> tuple[FloatArray, FloatArray]:
        """Derivatives of ln(range) by the parameters, and its sd by the spot's noise, at ranges (K,).

        Args:
            range_mm: from the reference plane.
            sd_px: 1 sigma of a single spot, in either coordinate.

        Returns:
            (N, K, L, S) derivatives of ln(range) and (N, K, L) relative sd by the spot's own noise; both NaN
            where the spot is outside the image.
        """
        _, slopes, seen = self._cells(range_mm, ranging=True)
        cell = self.cell
        by_range = slopes[..., cell.errors.start]
        strength = (by_range**2).sum(axis=-1)
        gradient = -(by_range[..., None] * slopes[..., cell.sensor]).sum(axis=-2) / strength[..., None]
        gradient[..., cell.bench_only] = 0.0  # a range depends neither on the ruler nor on a common tilt
        rows = self._spread(gradient[..., None, :])[..., 0, :]
        at = range_mm[:, None]
        own = sd_px / np.sqrt(strength) / at
        return np.where(seen[..., None], rows / at[..., None], np.nan), np.where(seen, own, np.nan)

    def in_frame(self, standoff_mm: FloatArray) -> BoolArray:
        """(N, J, L) whether the spot on a square target is in the image and the lens's valid domain."""
        return self._cells(standoff_mm)[2]

    def spots(self, standoff_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Spots on a square target at standoffs (J,) by the ruler, inside or outside the image.

        Returns:
            (N, J, L, 2) positions, px; (N, J, L, 2, S) derivatives by the parameters in prior sd; and
            (N, J, L, 2) 1 sigma by the error and the tilts of the placement.
        """
        spot, slopes, _ = self._cells(standoff_mm)
        tilt = radians(self.rig.bench.tilt_sd_deg)
        by_error = slopes[..., self.cell.errors] * np.array([self.rig.bench.placement_sd_mm, tilt, tilt])
        return spot, self._spread(slopes[..., self.cell.sensor]), np.sqrt((by_error**2).sum(axis=-1))

    def _cells(
        self, standoff_mm: FloatArray, ranging: bool = False
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """(N, J, L, 2) spots, (N, J, L, 2, I) derivatives by the I inputs, (N, J, L) in the image."""
        cell = self.cell
        common = np.array(self.sensors[:, cell.common])
        if ranging:
            common[:, cell.bench_only] = 0.0
        shape = (len(common), len(standoff_mm), len(self.rig.lasers))
        rays = self.sensors[:, cell.common.stop :].reshape(len(common), len(self.rig.lasers), len(RAY))
        parts = [
            *common.T[:, :, None, None],
            *np.moveaxis(rays, -1, 0)[:, :, None, :],
            *np.zeros(len(PLACEMENT)),
        ]
        inputs = np.stack([np.broadcast_to(p, shape) for p in parts], axis=-1)
        standoff = np.broadcast_to(standoff_mm[:, None], shape)
        spot, slopes, radius = _in_blocks(
            inputs.reshape(-1, inputs.shape[-1]), standoff.ravel(), cell.lens_name
        )
        inside = in_picture(spot, (self.rig.camera.width_px, self.rig.camera.height_px)).reshape(shape)
        lens = self.sensors[:, cell.lens].T
        fold = cell.model.unfolded_radius(lens[len(PINHOLE) :])
        seen = inside & (radius.reshape(shape) < fold[:, None, None])
        return spot.reshape(*shape, 2), slopes.reshape(*shape, 2, -1), seen

    def _spread(self, by_input: FloatArray) -> FloatArray:
        """Derivatives (N, J, L, C, I) by the sensor's inputs of a cell, as (..., S) by all parameters.

        In prior sd; the inputs are lens, reference and ray.
        """
        layout, cell = Layout(self.rig.camera.lens, by_input.shape[2]), self.cell
        whole = np.zeros((*by_input.shape[:-1], self.sensors.shape[1]))
        whole[..., layout.common] = by_input[..., cell.common]
        for laser in range(layout.lasers):
            whole[:, :, laser, :, layout.ray(laser)] = by_input[:, :, laser, :, cell.rays]
        return whole * self.table.prior_sd


def _in_blocks(
    inputs: FloatArray, standoff_mm: FloatArray, lens_name: LensName
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`_slopes` of any number of cells by one compiled program; the last block is padded."""
    count = len(inputs)
    indices = np.arange(-(-count // BLOCK) * BLOCK) % count
    chosen = np.split(indices, len(indices) // BLOCK)
    blocks = [_slopes(inputs[i], standoff_mm[i], lens_name) for i in chosen]
    spot, slopes, radius = (np.concatenate([np.asarray(b) for b in p]) for p in zip(*blocks, strict=True))
    return spot[:count], slopes[:count], radius[:count]


@jit_cached(static=1)
def _slopes(inputs: Array, standoff_mm: Array, lens_name: LensName) -> tuple[Array, Array, Array]:
    """(n, 2) spots, (n, 2, I) derivatives by the inputs, (n,) undistorted radii (infinite at depth <= 0)."""

    def spot(inputs: Array) -> Array:
        return jnp.stack(predict_cell(lens_name, tuple(inputs.T), standoff_mm), axis=1)

    directions = jnp.eye(inputs.shape[1])
    slopes = jax.vmap(lambda d: jax.jvp(spot, (inputs,), (jnp.broadcast_to(d, inputs.shape),))[1])(directions)
    cell = Layout(lens_name)
    x, y, tx, ty = inputs.T[cell.rays]
    depth = standoff_mm * (1.0 + inputs[:, cell.ruler_scale]) + inputs[:, cell.offset]
    radius = jnp.hypot(tx + x / depth, ty + y / depth)
    return spot(inputs), jnp.moveaxis(slopes, 0, -1), jnp.where(depth > 0, radius, jnp.inf)
