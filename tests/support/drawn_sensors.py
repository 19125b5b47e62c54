"""Sensors drawn from the posterior of a calibration, and readings of flat targets by them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.model.calibration import Calibration
from workbench.model.event import LaserRange, ReadingTaken
from workbench.sensor.calibrated import CalibratedSensor


def drawn_sensor(
    calibration: Calibration, random: np.random.Generator, change: Mapping[str, float]
) -> CalibratedSensor:
    """A true sensor that the calibration may have been made of, with parameters changed since, by name."""
    return changed_sensor(calibration, drawn_values(calibration, random), change)


def drawn_values(calibration: Calibration, random: np.random.Generator) -> dict[str, float]:
    """Parameters by name, with those of the bench, drawn from the posterior of the calibration."""
    parameters = calibration.laser_ranger.parameters
    values = random.multivariate_normal(parameters.values, parameters.covariance_array, method="svd")
    return dict(zip(parameters.names, values.tolist(), strict=True))


def changed_sensor(
    calibration: Calibration, values: Mapping[str, float], change: Mapping[str, float]
) -> CalibratedSensor:
    """Sensor of the values, with parameters changed by name."""
    true = {name: values[name] for name in calibration.geometry()}
    return CalibratedSensor(calibration, true | {name: true[name] + by for name, by in change.items()})


def flat_readings(
    sensor: CalibratedSensor,
    standoff_mm: float,
    count: int,
    random: np.random.Generator,
    placement_sd_mm: float,
) -> list[ReadingTaken]:
    """Readings of a square flat target at one placement, with noise of every spot and common speckle."""
    noise = sensor.calibration.laser_ranger.noise
    true_mm = np.array([standoff_mm + placement_sd_mm * random.standard_normal()])
    still = {
        i: sensor.spot_px(i, true_mm)[0] + noise.speckle_sd_px * random.standard_normal(2) for i in sensor.ids
    }
    return [_reading(sensor, standoff_mm, still, random, placement_sd_mm) for _ in range(count)]


def _reading(
    sensor: CalibratedSensor,
    standoff_mm: float,
    still: Mapping[str, Any],
    random: np.random.Generator,
    placement_sd_mm: float,
) -> ReadingTaken:
    sd_px = sensor.calibration.laser_ranger.noise.spot_sd_px
    pixels = {i: px + sd_px * random.standard_normal(2) for i, px in still.items()}
    lasers = tuple(
        LaserRange(laser_id=i, range_mm=standoff_mm, sigma_mm=1.0, u_px=float(px[0]), v_px=float(px[1]))
        for i, px in pixels.items()
    )
    return ReadingTaken(
        trial="v.1",
        scene=f"v.1/{standoff_mm:g}mm/00",
        standoff_mm=standoff_mm,
        reading=0,
        status="done",
        range_mm=standoff_mm,
        sigma_mm=1.0,
        reference_sd_mm=placement_sd_mm,
        lasers=lasers,
    )
