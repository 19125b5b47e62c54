"""Readings of surfaces by a calibrated sensor whose errors are drawn from its stated covariance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tests.support.rangers import IDS, thesis_ranger
from tests.support.surfaces import SD_PX, Surface
from workbench.model.arrays import FloatArray
from workbench.ranging.lines import fit_line
from workbench.ranging.ranger import Ranger
from workbench.ranging.shape import Shape
from workbench.sensor.calibrated import CalibratedSensor

MEETING_STEPS = 40
"""Repetitions of the search for the point where a beam meets a surface; it converges by slope times tangent,
at most 1 / 50."""


@dataclass(frozen=True)
class DrawnSensors:
    """True sensors, drawn about one calibration by its covariance."""

    draws: int
    seed: int

    @cached_property
    def ranger(self) -> Ranger:
        """Ranger of the calibration."""
        return thesis_ranger()

    @cached_property
    def front_mm(self) -> tuple[float, float]:
        """Ends of the front by the calibration."""
        return self.ranger.sensor.front_mm(self.ranger.sensor.rows[0], 0.0)

    @cached_property
    def sensors(self) -> list[CalibratedSensor]:
        """The true sensors."""
        stated = self.ranger.calibration.laser_ranger.parameters
        rng = np.random.default_rng(self.seed)
        root = np.linalg.cholesky(stated.covariance_array + 1e-18 * np.eye(len(stated.names)))
        errors = rng.normal(size=(self.draws, len(root))) @ root.T
        geometry = self.ranger.calibration.geometry()
        found = [dict(zip(stated.names, error, strict=True)) for error in errors.tolist()]
        return [
            CalibratedSensor(self.ranger.calibration, {n: value + error[n] for n, value in geometry.items()})
            for error in found
        ]

    def readings(self, surface: Surface, n: int, seed: int) -> list[Shape]:
        """About n readings, the same number by each sensor."""
        rng = np.random.default_rng(seed)
        spot_sd = np.sqrt(SD_PX**2 - self.ranger.calibration.laser_ranger.noise.speckle_sd_px**2)
        sd = np.full((len(IDS), 2), spot_sd)
        shapes = []
        for true in self.sensors:
            spots = _spots(true, surface)
            hit = np.flatnonzero(np.isfinite(spots).all(axis=1)).tolist()
            for noise in rng.normal(0.0, SD_PX, (n // self.draws, *spots.shape)):
                ranges = self.ranger.sensor.ranges(IDS, spots + noise, sd)
                (row,) = self.ranger.sensor.rows
                shapes.append(fit_line(self.ranger.sensor, row, IDS, ranges, hit).shape)
        return shapes


def _spots(sensor: CalibratedSensor, surface: Surface) -> FloatArray:
    """(n, 2) where the beams meet the surface, px; NaN for a beam that misses it."""
    found = []
    for laser_id in IDS:
        x, tangent = (sensor.overrides[f"{laser_id}.{name}"] for name in ("x_mm", "tx"))
        range_mm = 1000.0
        for _ in range(MEETING_STEPS):
            with np.errstate(invalid="ignore"):  # beside a cylinder
                range_mm = float(surface(np.array([x + tangent * (range_mm + sensor.offset_mm)]))[0])
        found.append(sensor.spot_px(laser_id, np.array([range_mm]))[0])
    return np.array(found)
