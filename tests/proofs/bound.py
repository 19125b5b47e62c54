"""The Bayesian Cramér-Rao bound at each simulated truth, by differences of the simulator: nothing of ours.

H. L. Van Trees, "Detection, Estimation, and Modulation Theory" I (1968): the information of the data and that
of the prior add. It is taken at each truth.
"""

from __future__ import annotations

import numpy as np

from tests.proofs import simulate
from tests.proofs.simulate import Calibrations
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig

STEP_SD = 1e-4
"""Of the differences, in prior standard deviations."""


def parameter_covariance(rig: Rig, standoffs_mm: FloatArray, data: Calibrations) -> FloatArray:
    """(N, S, S) bound on the covariance of the sensor's parameters; constants have none."""
    count, placements = data.errors.shape[:2]
    sd = np.array([p.sd for p in simulate.priors(rig)])
    tilt = np.radians(rig.bench.tilt_sd_deg)
    error_sd = np.array([rig.bench.placement_sd_mm, tilt, tilt])

    def seen(truth: FloatArray, errors: FloatArray) -> FloatArray:
        z0 = simulate.depths(rig, truth, standoffs_mm, errors[..., 0])
        slopes = simulate.tilted(rig, truth, errors[..., 1:])
        return simulate.spots(rig, truth, z0, slopes) / data.sd_px

    def difference(sensor_step: FloatArray, error_step: FloatArray) -> FloatArray:
        ahead = seen(data.truth + STEP_SD * sensor_step, data.errors + STEP_SD * error_step)
        behind = seen(data.truth - STEP_SD * sensor_step, data.errors - STEP_SD * error_step)
        slope = (ahead - behind) / (2.0 * STEP_SD)
        return np.where(np.isfinite(slope), slope, 0.0).reshape(count, placements, -1)

    by_sensor = np.stack([difference(step, np.zeros(3)) for step in np.diag(sd)], axis=-1)
    by_error = np.stack([difference(np.zeros(len(sd)), step) for step in np.diag(error_sd)], axis=-1)
    # The placements' errors are noise of known covariance: of the spots of one placement together.
    noise = np.eye(by_error.shape[2]) + by_error @ np.swapaxes(by_error, 2, 3)
    information = (np.swapaxes(by_sensor, 2, 3) @ np.linalg.solve(noise, by_sensor)).sum(axis=1)
    covariance = np.linalg.inv(information + np.eye(len(sd)))
    return np.asarray(covariance * np.outer(sd, sd))


def range_variance(
    rig: Rig, truth: FloatArray, covariance: FloatArray, range_mm: FloatArray, spot_sd_px: float
) -> FloatArray:
    """(N, K, L) bound on the variance of a range from one spot of this sd at K ranges of a square target."""
    sd = np.array([p.sd for p in simulate.priors(rig)])

    def seen(sensors: FloatArray, step_mm: float = 0.0) -> FloatArray:
        z0 = range_mm + sensors[:, simulate.lens_size(rig)][:, None] + step_mm
        return simulate.spots(rig, sensors, z0, np.zeros((*z0.shape, 2)))

    by_range = (seen(truth, 1e-3) - seen(truth, -1e-3)) / 2e-3
    information = (by_range**2).sum(axis=-1)
    slopes = []
    for step in np.diag(STEP_SD * sd):
        by_parameter = seen(truth + step) - seen(truth - step)
        slopes.append(-(by_range * by_parameter).sum(axis=-1) / information / (2.0 * STEP_SD))
    scaled = covariance / np.outer(*(np.where(sd > 0, sd, 1.0),) * 2)
    gradient = np.stack(slopes, axis=-1)
    shared = np.einsum("nkls,nst,nklt->nkl", gradient, scaled, gradient, optimize=True)
    return np.asarray(shared + spot_sd_px**2 / information)
