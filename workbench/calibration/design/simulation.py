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
from workbench.sensor.range_model import RangeModel


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
        laser = np.tile(np.arange(layout.lasers), len(range_mm))
        sd_px = np.hypot(noise.spot_sd_px, noise.speckle_sd_px) * self.fit.noise_scale
        found = [
            self._range_model(n).ranges(laser, one.reshape(-1, 2), np.full((len(laser), 2), sd_px[n]))
            for n, one in enumerate(spot)
        ]
        measured = np.array([one.range_mm for one in found]).reshape(spot.shape[:3])
        sd = np.array([one.sigma_mm for one in found]).reshape(spot.shape[:3])
        seen = self._seen(range_mm)
        return SimulatedRanges(
            np.where(seen, measured - range_mm[:, None], np.nan), np.where(seen, sd, np.nan)
        )

    def _range_model(self, sensor: int) -> RangeModel:
        """Inverse of the model by the calibration of one sensor, given by its index."""
        layout = Layout(self.rig.camera.lens, len(self.rig.lasers))
        values, covariance = self.fit.sensor[sensor], self.fit.sensor_covariance[sensor]
        curves = SpotCurves(layout.model, values[layout.lens], values[layout.rays].reshape(-1, len(RAY)))
        own = np.array([layout.own(n) for n in range(layout.lasers)])
        return RangeModel(curves, float(values[layout.offset]), own, layout.offset, covariance)

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
