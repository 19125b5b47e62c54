"""Simulated calibrations: sensors drawn from a rig's tolerances, each calibrated on positions of its spots.

Each sensor gets its own placement errors, tilts, speckle and noise. All are fitted at once by
`estimation.batch`. Sensors and calibrations share one forward model: a simulation shows what the data
determine, not whether the model is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from workbench.calibration.data.observations import PlacementInfo
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.estimation.batch import BatchFit, fit_batch
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import PLACEMENT, ParameterTable, sensor_parameters
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.optics.image import in_picture
from workbench.optics.rays import RAY
from workbench.sensor.curves import SpotCurves

BLOCK = 64
"""Number of sensors that are ranged together; their tables fit into the processor's cache."""


@dataclass(frozen=True)
class SimulatedRanges:
    """Ranges of N sensors at K ranges by L lasers, one spot each; NaN where the spot is outside the image."""

    error_mm: FloatArray
    """(N, K, L) range by the calibration - true range; infinite beyond the laser's vanishing point."""
    sd_mm: FloatArray
    """(N, K, L) as the calibration states it, 1 sigma."""


@dataclass(frozen=True)
class SimulatedCalibrations:
    """N sensors with S parameters, and a calibration of each."""

    rig: Rig
    truth: FloatArray
    """(N, S) in the order of `ParameterTable`."""
    fit: BatchFit

    def ranges(self, range_mm: FloatArray, rng: np.random.Generator) -> SimulatedRanges:
        """Range one spot of each laser on a square target at true ranges (K,), with its noise and speckle."""
        noise, layout = self.rig.noise, Layout(self.rig.camera.lens, len(self.rig.lasers))
        still = np.zeros((*self.truth.shape[:1], len(range_mm), len(PLACEMENT)))
        bench = np.array(self.truth)
        bench[:, layout.bench_only] = 0.0
        spot = _spots(self.rig, bench, range_mm, still)
        for sd_px in (noise.spot_sd_px, noise.speckle_sd_px):
            spot = spot + rng.normal(0.0, sd_px, spot.shape)
        measured, sd = self.ranges_of(spot)
        seen = self._seen(range_mm)
        return SimulatedRanges(
            np.where(seen, measured - range_mm[:, None], np.nan), np.where(seen, sd, np.nan)
        )

    def ranges_of(self, spot_px: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, K, L) ranges of spots (N, K, L, 2) by each calibration, and their sd; as `RangeModel`."""
        shape = spot_px.shape[:3]
        measured, sd = np.empty(shape), np.empty(shape)
        for first in range(0, len(spot_px), BLOCK):
            block = slice(first, first + BLOCK)
            measured[block], sd[block] = self._ranges_of(spot_px[block], block)
        return measured, sd

    def _ranges_of(self, spot_px: FloatArray, sensors: slice) -> tuple[FloatArray, FloatArray]:
        """`ranges_of` for some sensors."""
        noise, layout, shape = (
            self.rig.noise,
            Layout(self.rig.camera.lens, len(self.rig.lasers)),
            spot_px.shape,
        )
        values, covariance = self.fit.sensor[sensors], self.fit.sensor_covariance[sensors]
        rays = values[:, layout.rays].reshape(-1, len(RAY))
        curves = SpotCurves(layout.model, np.repeat(values[:, layout.lens], layout.lasers, axis=0), rays)
        curve = np.broadcast_to(np.arange(len(rays)).reshape(-1, 1, layout.lasers), shape[:3])
        sd_px = np.hypot(noise.spot_sd_px, noise.speckle_sd_px) * self.fit.noise_scale[sensors]
        inverse_sd = np.broadcast_to(1.0 / sd_px[:, None, None, None], shape).reshape(-1, 2)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # no range, or infinite
            found = curves.invert(curve.ravel(), spot_px.reshape(-1, 2), inverse_sd)
            w = found.inverse_depth_per_mm.reshape(shape[:3])
            range_mm = np.where(w <= 0, np.inf, 1.0 / w) - values[:, layout.offset, None, None]
        # A range depends on the lens, the laser's own ray and the offset: no other covariance matters.
        own = np.array([[*layout.own(n), layout.offset] for n in range(layout.lasers)])
        by_offset = np.full((*shape[:3], 1), -1.0)
        gradient = np.concatenate((found.dz.reshape(*shape[:3], -1), by_offset), axis=3).swapaxes(1, 2)
        propagated = gradient @ covariance[:, own[:, :, None], own[:, None]]  # (n, L, K, C + 1)
        variance = (propagated * gradient).sum(axis=3).swapaxes(1, 2)
        return range_mm, np.sqrt(variance + found.z_sd_of_spot_mm.reshape(shape[:3]) ** 2)

    def _seen(self, range_mm: FloatArray) -> BoolArray:
        """(N, K, L) whether each sensor has the spot in its image."""
        return Expectation(self.rig, self.truth).in_frame(range_mm)


def simulate_calibrations(
    rig: Rig, standoffs_mm: Sequence[float], repeats: int, count: int, rng: np.random.Generator
) -> SimulatedCalibrations:
    """Draw `count` sensors from the priors of the rig, and calibrate each.

    Args:
        rig: priors, noise, and tolerances of the placements.
        standoffs_mm: J standoffs, by the ruler.
        repeats: captures of each laser at each standoff.
        count: number of sensors.
        rng: source of random numbers.

    Raises:
        BadInputError: at a standoff no sensor has a spot in the image.
    """
    table = ParameterTable(sensor_parameters(rig))
    truth = rng.normal(table.prior_mean, table.prior_sd, (count, len(table.prior_mean)))
    standoff = np.array(standoffs_mm)
    tilt = radians(rig.bench.tilt_sd_deg)
    error = rng.normal(0.0, (rig.bench.placement_sd_mm, tilt, tilt), (count, len(standoff), len(PLACEMENT)))
    spot = _spots(rig, truth, standoff, error)
    inside = in_picture(spot, (rig.camera.width_px, rig.camera.height_px))
    seen = inside & Expectation(rig, truth).in_frame(standoff)
    for at, in_image in zip(standoffs_mm, np.moveaxis(seen, 1, 0), strict=True):
        if not in_image.any():
            raise BadInputError(f"standoff {at:g} mm: expected a laser's spot in the image, there is none")
    spread = np.hypot(rig.noise.spot_sd_px / np.sqrt(repeats), rig.noise.speckle_sd_px)
    position = np.where(seen[..., None], spot + rng.normal(0.0, spread, spot.shape), np.nan)
    placements = tuple(PlacementInfo(f"{at:g} mm", at, np.nan, 0.0) for at in standoffs_mm)
    return SimulatedCalibrations(rig, truth, fit_batch(rig, placements, position, np.array(spread)))


def _spots(rig: Rig, sensors: FloatArray, standoff_mm: FloatArray, error: FloatArray) -> FloatArray:
    """(N, J, L, 2) positions of the spots of sensors (N, S) at standoffs (J,), errors (N, J, 3)."""
    cell = Layout(rig.camera.lens)
    rays = sensors[:, cell.common.stop :].reshape(len(sensors), 1, len(rig.lasers), len(RAY))
    inputs = (
        *sensors[:, cell.common].T[:, :, None, None],
        *np.moveaxis(rays, -1, 0),
        *np.moveaxis(error, -1, 0)[..., None],
    )
    u, v = predict_cell(rig.camera.lens, inputs, standoff_mm[:, None])
    return np.stack(np.broadcast_arrays(u, v), axis=-1)
