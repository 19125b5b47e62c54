"""Expected spots and ranges: against differences of the simulator and the calibrated sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs import bound, simulate
from tests.support.rigs import PROVENANCE, World, thesis_rig
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.standoffs import (
    drawn_sensors,
    posterior,
)
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.rig import Rig, load_rig
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[4]
RIG = load_rig(ROOT / "rigs/thesis-emulated.yaml")


def shifted(rig: Rig) -> Expectation:
    """One sensor that is not the expected one, all of whose spots are in frame."""
    base = drawn_sensors(rig)
    rng = np.random.default_rng(5)
    sd = base.table.prior_sd.copy()
    sd[1:3] = 5.0
    return Expectation(rig, (base.table.prior_mean + sd * rng.uniform(-1, 1, len(sd)))[None])


def test_spots_tell_what_differences_of_the_simulator_say() -> None:
    """The bound of the proofs: OpenCV's lens and linear algebra, differences, the same noise."""
    sensors = shifted(RIG)
    standoffs = np.array([160.0, 300.0, 1000.0, 4000.0])
    sd_px = float(np.hypot(0.05 / np.sqrt(10), 0.04))
    shape = (1, len(standoffs), 4, 2)
    data = simulate.Calibrations(sensors.sensors, np.zeros((1, 4, 3)), np.zeros(shape), np.full(shape, sd_px))
    theirs = bound.parameter_covariance(RIG, standoffs, data)[0]
    free = sensors.table.free
    ours = posterior(sensors.spot_rows(standoffs, sd_px)[..., free])[0]
    sd = sensors.table.prior_sd[free]
    # Differences and derivatives part by some 1e-5 of the largest.
    np.testing.assert_allclose(np.sqrt(np.diag(ours)) * sd, np.sqrt(np.diag(theirs))[free], rtol=1e-4)


def test_ranges_depend_on_parameters_as_the_sensor_says() -> None:
    world = World(thesis_rig(), 2)
    calibration = calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0]
    sensor = CalibratedSensor(calibration)
    parameters = calibration.laser_ranger.parameters
    expectation = Expectation(world.rig, np.array([parameters.values]))
    at = np.array([200.0, 900.0, 4000.0])
    noise = calibration.laser_ranger.noise
    rows, own = expectation.range_rows(at, float(np.hypot(noise.spot_sd_px, noise.speckle_sd_px)))
    prior_sd = np.array(parameters.prior_sd)
    for laser, laser_id in enumerate(sensor.ids):
        found = sensor.typical_ranges(laser_id, at)
        np.testing.assert_allclose(
            rows[0, :, laser], found.by_parameter * prior_sd / at[:, None], rtol=1e-6, atol=1e-12
        )
        np.testing.assert_allclose(own[0, :, laser], found.spot_sd_mm / at, rtol=1e-6)


def test_a_range_out_of_frame_is_not_a_number() -> None:
    rows, own = shifted(RIG).range_rows(np.array([40.0, 300.0]), 0.05)
    assert np.isnan(own[0, 0, [0, 3]]).all()
    assert np.isnan(rows[0, 0, [0, 3]]).all()
    assert np.isfinite(own[0, 1]).all()


def test_spots_and_their_derivatives_are_those_of_opencv_s_lens() -> None:
    """Differences of OpenCV's projection by every free parameter of the sensor, in prior sd."""
    rig = thesis_rig()
    world = World(rig, 3)
    names = list(world.values)
    standoffs = np.array([200.0, 1500.0])
    values = np.array([world.values[name] for name in names])
    expectation = Expectation(rig, values[None])
    spot, slopes, error_sd = (part[0] for part in expectation.spots(standoffs))

    def pixels(at: np.ndarray, error_mm: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> np.ndarray:
        world.values = dict(zip(names, at, strict=True))
        z0 = standoffs * (1 + world.values["ruler_scale"]) + world.values["offset_mm"] + error_mm
        tilt = np.array([yaw, pitch]) + world.common_tilt
        return np.array([[world.pixel(i, z, *tilt) for i in rig.laser_ids] for z in z0])

    np.testing.assert_allclose(spot, pixels(values), rtol=1e-9)
    sd = expectation.table.prior_sd
    for k in expectation.table.free:
        step = np.zeros(len(values))
        step[k] = 1e-3 * sd[k]
        numeric = (pixels(values + step) - pixels(values - step)) / 2e-3
        np.testing.assert_allclose(slopes[..., k], numeric, rtol=1e-4, atol=1e-4)
    tilt = np.radians(rig.bench.tilt_sd_deg)
    moves = [
        (pixels(values, 1e-3) - pixels(values, -1e-3)) / 2e-3 * rig.bench.placement_sd_mm,
        (pixels(values, yaw=1e-4) - pixels(values, yaw=-1e-4)) / 2e-4 * tilt,
        (pixels(values, pitch=1e-4) - pixels(values, pitch=-1e-4)) / 2e-4 * tilt,
    ]
    np.testing.assert_allclose(error_sd, np.sqrt(np.sum(np.square(moves), axis=0)), rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("count", [2, 4])
def test_sensors_are_looked_at_one_by_one(count: int) -> None:
    sensors = drawn_sensors(RIG, count)
    together = sensors.spot_rows(np.array([300.0, 900.0]), 0.05)
    for n in range(count):
        alone = Expectation(RIG, sensors.sensors[n : n + 1]).spot_rows(np.array([300.0, 900.0]), 0.05)
        np.testing.assert_allclose(together[n], alone[0], rtol=1e-10, atol=1e-12)


def test_spots_outside_the_picture_or_behind_the_pinhole_are_not_in_frame() -> None:
    table = drawn_sensors(RIG).table
    expectation = Expectation(RIG, table.prior_mean[None])
    # u = 319.5 +- 533.3 x 60 / z leaves the picture of 640 px nearer than 100 mm; 30 mm nearer than 50 mm.
    found = expectation.in_frame(np.array([-200.0, 45.0, 60.0, 110.0]))[0]
    assert found.sum(axis=1).tolist() == [0, 0, 2, 4]
    assert found[2].tolist() == [False, True, True, False]
    assert not expectation.spot_rows(np.array([45.0]), 0.05).any()


@pytest.mark.parametrize("ruler_scale", [0.0, 0.5, -0.25])
def test_spots_beyond_the_fold_of_a_sensor_s_lens_are_not_in_frame(ruler_scale: float) -> None:
    """37 mm deep, the outer lasers' spots lie at r = 1.62: in the picture, where the radius grows again."""
    table = drawn_sensors(RIG).table
    names = [p.name for p in table.parameters]
    sensors = np.repeat(table.prior_mean[None], 2, axis=0)
    for name, value in (("k1", -0.5), ("k2", 0.09), ("k3", 0.0)):
        sensors[1, names.index(name)] = value
    sensors[:, names.index("ruler_scale")] = ruler_scale
    depth_mm = np.array([37.0, 110.0])
    standoff = (depth_mm - table.prior_mean[names.index("offset_mm")]) / (1.0 + ruler_scale)
    expectation = Expectation(RIG, sensors)
    u = expectation.spots(standoff)[0][1, 0, :, 0]
    assert ((u > 0) & (u < 639)).all()
    assert expectation.in_frame(standoff)[1].tolist() == [[False, True, True, False], [True] * 4]
    assert expectation.in_frame(standoff)[0].tolist() == [[False] * 4, [True] * 4]
