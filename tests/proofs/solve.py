"""The two ways to a calibration: many at once, and as `workbench fit` does it, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.proofs.simulate import Calibrations
from workbench.calibration.data.observations import Observation, PlacementInfo
from workbench.calibration.estimation.batch import fit_batch
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig


@dataclass(frozen=True)
class Solved:
    """N calibrations of S parameters."""

    sensor: FloatArray
    """(N, S)"""
    covariance: FloatArray
    """(N, S, S)"""
    noise_scale: FloatArray
    """(N,)"""
    converged: FloatArray
    """(N,) 1 or 0."""


Solve = Callable[[Rig, Sequence[PlacementInfo], Calibrations], Solved]


def at_once(rig: Rig, placements: Sequence[PlacementInfo], data: Calibrations) -> Solved:
    """By `calibration.batch`: the whole model."""
    fitted = fit_batch(rig, placements, data.position_px, data.sd_px)
    return Solved(fitted.sensor, fitted.sensor_covariance, fitted.noise_scale, fitted.converged.astype(float))


def one_by_one(rig: Rig, placements: Sequence[PlacementInfo], data: Calibrations) -> Solved:
    """As `workbench fit` from the means of the repeats on: spots that lie apart rejected, terms chosen."""
    sensors, covariances, scales, converged = [], [], [], []
    for position, sd in zip(data.position_px, data.sd_px, strict=True):
        seen = _observations(rig, placements, position, sd)
        fitted = fit_calibration(rig, seen)
        sensors.append(fitted.values[fitted.sensor])
        covariances.append(fitted.covariance[fitted.sensor, fitted.sensor])
        scales.append(fitted.noise_scale)
        converged.append(float(fitted.converged))
    return Solved(np.array(sensors), np.array(covariances), np.array(scales), np.array(converged))


def _observations(
    rig: Rig, placements: Sequence[PlacementInfo], position: FloatArray, sd: FloatArray
) -> list[Observation]:
    """One observation a cell: the mean of its repeats and its sd; the fit adds speckle."""
    own = np.sqrt(np.maximum(sd**2 - rig.noise.speckle_sd_px**2, 0.0))
    return [
        Observation(f"{laser} {p.key}", laser, p.key, p.standoff_mm, 0, *position[j, i], *own[j, i])
        for j, p in enumerate(placements)
        for i, laser in enumerate(rig.laser_ids)
        if np.isfinite(position[j, i]).all()
    ]
