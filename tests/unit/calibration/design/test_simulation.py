"""Simulated calibrations: coverage of their statements, and spots of another program."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.proofs import simulate
from tests.support.rigs import fisheye_rig, thesis_rig
from workbench.calibration.design.simulation import BLOCK, SimulatedCalibrations, simulate_calibrations
from workbench.calibration.estimation.batch import BatchFit
from workbench.calibration.model.layout import Layout
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.sensor.curves import SpotCurves
from workbench.sensor.range_model import RangeModel

STANDOFFS_MM = (125.0, 210.0, 400.0, 900.0, 2200.0, 4500.0)
RANGES_MM = np.array([200.0, 600.0, 2000.0])
SENSORS = 160


@pytest.fixture(scope="module")
def simulated() -> SimulatedCalibrations:
    return simulate_calibrations(thesis_rig(), STANDOFFS_MM, 5, SENSORS, np.random.default_rng(11))


def test_parameters_lie_in_their_stated_intervals(simulated: SimulatedCalibrations) -> None:
    size = simulated.truth.shape[1]
    free = simulated.fit.table.free[simulated.fit.table.free < size]
    z = (simulated.fit.sensor - simulated.truth)[:, free] / simulated.fit.sd[:, free]
    # Parameters of one sensor are correlated: the spread of the coverage is that of SENSORS independent ones.
    assert abs((np.abs(z) < 1.96).mean() - 0.95) < 3 * np.sqrt(0.95 * 0.05 / SENSORS)
    assert (np.abs(z.std(axis=0) - 1) < 4 / np.sqrt(2 * SENSORS)).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_ranges_lie_in_their_stated_intervals(simulated: SimulatedCalibrations, seed: int) -> None:
    found = simulated.ranges(RANGES_MM, np.random.default_rng(seed))
    z = (found.error_mm / found.sd_mm)[np.isfinite(found.error_mm)]
    assert len(z) > 0.95 * SENSORS * len(RANGES_MM) * 4
    assert abs((np.abs(z) < 1.96).mean() - 0.95) < 3 * np.sqrt(0.95 * 0.05 / SENSORS)


def test_ranges_without_noise_invert_spots_of_another_program(simulated: SimulatedCalibrations) -> None:
    """Spots by OpenCV's lens and linear algebra, as in the proofs; the calibration is the truth itself."""
    rig, truth = simulated.rig, simulated.truth
    quiet = rig.model_copy(
        update={"noise": rig.noise.model_copy(update={"spot_sd_px": 1e-9, "speckle_sd_px": 0.0})}
    )
    depth = RANGES_MM + truth[:, [simulate.lens_size(rig)]]
    spots = simulate.spots(rig, truth, depth, np.zeros((*depth.shape, 2)))
    inside = simulate.in_frame(rig, spots)
    exact = SimulatedCalibrations(quiet, truth, _fitted_to(simulated, truth))
    found = exact.ranges(RANGES_MM, np.random.default_rng(1))
    seen = np.isfinite(found.error_mm)
    assert (seen == inside).mean() > 0.99
    assert np.abs(found.error_mm[seen]).max() < 1e-3


@pytest.mark.long_cases
@pytest.mark.parametrize("rig", [thesis_rig(), fisheye_rig()], ids=lambda rig: rig.camera.lens)
def test_ranges_of_all_sensors_are_those_of_each_alone(rig: Rig) -> None:
    count = BLOCK + BLOCK // 3
    simulated = simulate_calibrations(rig, STANDOFFS_MM, 5, count, np.random.default_rng(3))
    rng = np.random.default_rng(4)
    depth = np.geomspace(150.0, 5000.0, 4) + simulated.truth[:, [simulate.lens_size(rig)]]
    spots = simulate.spots(rig, simulated.truth, depth, np.zeros((*depth.shape, 2)))
    spots = spots + rng.normal(0.0, 0.05, spots.shape)
    spots[0] -= 1000.0  # beyond the vanishing points
    together = simulated.ranges_of(spots)
    alone = np.array([_ranges_alone(simulated, n, one) for n, one in enumerate(spots)])
    for part, ours in enumerate(together):
        np.testing.assert_allclose(ours, alone[:, part], rtol=1e-12)
    assert np.isfinite(together[0]).mean() > 0.9
    assert not np.isfinite(together[0][0]).all()


def _ranges_alone(simulated: SimulatedCalibrations, sensor: int, spots: FloatArray) -> FloatArray:
    """(2, K, L) ranges of spots (K, L, 2) by the ranger of one sensor, and their sd."""
    noise, lasers = simulated.rig.noise, len(simulated.rig.lasers)
    layout, values = Layout(simulated.rig.camera.lens, lasers), simulated.fit.sensor[sensor]
    curves = SpotCurves(layout.model, values[layout.lens], values[layout.rays].reshape(lasers, -1))
    own = np.array([layout.own(n) for n in range(lasers)])
    covariance = simulated.fit.sensor_covariance[sensor]
    model = RangeModel(curves, float(values[layout.offset]), own, layout.offset, covariance)
    sd_px = np.hypot(noise.spot_sd_px, noise.speckle_sd_px) * simulated.fit.noise_scale[sensor]
    laser = np.tile(np.arange(lasers), len(spots))
    found = model.ranges(laser, spots.reshape(-1, 2), np.full((len(laser), 2), sd_px))
    return np.array([found.range_mm, found.sigma_mm]).reshape(2, *spots.shape[:2])


def _fitted_to(simulated: SimulatedCalibrations, truth: FloatArray) -> BatchFit:
    values = simulated.fit.values.copy()
    values[:, : truth.shape[1]] = truth
    return replace(simulated.fit, values=values)
