"""Simulated calibrations: coverage of their statements, and spots of another program."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.proofs import simulate
from tests.support.rigs import thesis_rig
from workbench.calibration.design.simulation import SimulatedCalibrations, simulate_calibrations
from workbench.calibration.estimation.batch import BatchFit
from workbench.model.arrays import FloatArray

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


def _fitted_to(simulated: SimulatedCalibrations, truth: FloatArray) -> BatchFit:
    values = simulated.fit.values.copy()
    values[:, : truth.shape[1]] = truth
    return replace(simulated.fit, values=values)
