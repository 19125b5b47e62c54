"""The calibrated sensor: spots to ranges, and the truth of the stated deviations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.rigs import World, thesis_rig
from tests.unit.test_calibration_file import PROVENANCE
from workbench.calibration.export import calibrate
from workbench.calibration.fit import fit
from workbench.calibration.sensor import Sensor
from workbench.model.acceptance import Acceptance

STANDOFFS_MM = np.array([120.0, 200.0, 350.0, 700.0, 1300.0, 2500.0, 5000.0])


def sensor_of(seed: int) -> tuple[Sensor, World]:
    world = World(thesis_rig(), seed)
    fitted = fit(world.rig, world.sightings())
    return Sensor(calibrate(fitted, Acceptance(), PROVENANCE)[0]), world


@pytest.fixture(scope="module")
def sensor() -> Sensor:
    return sensor_of(1)[0]


@pytest.mark.parametrize("laser_id", ["L1", "L3"])
def test_spots_and_ranges_are_inverse(sensor: Sensor, laser_id: str) -> None:
    spots = sensor.spot_px(laser_id, STANDOFFS_MM)
    found = sensor.ranges([laser_id] * len(spots), spots, np.full_like(spots, 0.05))
    np.testing.assert_allclose(found.range_mm, STANDOFFS_MM, rtol=1e-9)
    np.testing.assert_allclose(found.misfit_sd, 0.0, atol=1e-6)


def test_a_spot_beyond_infinity_has_no_range(sensor: Sensor) -> None:
    far = sensor.spot_px("L4", np.array([np.inf]))
    found = sensor.ranges(["L4"], far - [5.0, 0.0], np.full((1, 2), 0.05))
    assert not np.isfinite(found.range_mm[0])


def test_the_covariance_is_the_scatter_of_drawn_calibrations(sensor: Sensor) -> None:
    """Parameters drawn from their covariance, spots ranged anew with each."""
    parameters = sensor.calibration.laser_ranger.parameters
    ids, at = ["L1", "L4", "L4"], np.array([300.0, 300.0, 1500.0])
    spots = np.concatenate([sensor.spot_px(i, at[n : n + 1]) for n, i in enumerate(ids)])
    stated = sensor.ranges(ids, spots, np.full((3, 2), 1e-9))
    calibration_part = stated.covariance_mm2 - np.diag(stated.spot_sd_mm**2)

    rng = np.random.default_rng(3)
    draws = rng.multivariate_normal(parameters.values, parameters.covariance_array, 300, method="eigh")
    world = World(thesis_rig(), 1)
    ranges = []
    for values in draws:
        world.values = dict(zip(parameters.names, values, strict=True))
        # What the drawn sensor would have seen, linearised backwards: same spots, other ranges.
        step = 0.01 * at
        ahead = np.array(
            [world.pixel(i, z + world.values["offset_mm"]) for i, z in zip(ids, at, strict=True)]
        )
        beyond = np.array(
            [world.pixel(i, z + s + world.values["offset_mm"]) for i, z, s in zip(ids, at, step, strict=True)]
        )
        slope = (beyond[:, 0] - ahead[:, 0]) / (1 / (at + step) - 1 / at)
        ranges.append(1 / (1 / at + (spots[:, 0] - ahead[:, 0]) / slope))
    scatter = np.cov(np.array(ranges).T)
    # 300 draws know a variance to sqrt(2 / 300) = 8 %; three of these, and a little for the linearisation.
    np.testing.assert_allclose(np.sqrt(np.diag(scatter)), np.sqrt(np.diag(calibration_part)), rtol=0.13)
    correlation = scatter / np.sqrt(np.outer(np.diag(scatter), np.diag(scatter)))
    expected = calibration_part / np.sqrt(np.outer(np.diag(calibration_part), np.diag(calibration_part)))
    np.testing.assert_allclose(correlation, expected, atol=0.2)


def test_speckle_stays_in_every_range(sensor: Sensor) -> None:
    spot = sensor.spot_px("L4", np.array([1000.0]))
    sharp = sensor.ranges(["L4"], spot, np.full((1, 2), 1e-9)).spot_sd_mm[0]
    f_b = sensor.calibration.geometry()["f_px"] * sensor.calibration.geometry()["L4.x_mm"]
    # A pinhole's r^2 / (f b) on the 0.04 px of the speckle; the lens bends it by a per cent or two.
    assert sharp == pytest.approx(0.04 * 1000.0**2 / f_b, rel=0.05)


def test_ranges_of_unseen_standoffs_lie_where_stated() -> None:
    """24 rigs: standardised errors of ranges at standoffs that the fits did not see."""
    scores = []
    for seed in range(200, 224):
        sensor, world = sensor_of(seed)
        for laser_id in ("L2", "L4"):
            for standoff in (180.0, 750.0, 3000.0):
                spot = world.pixel(laser_id, standoff + world.values["offset_mm"])[None]
                noise = np.random.default_rng([seed, int(standoff)]).normal(0.0, 0.05, (1, 2))
                own = np.full((1, 2), 0.03)  # with the speckle's 0.04 px: 0.05
                found = sensor.ranges([laser_id], spot + noise, own)
                scores.append((found.range_mm[0] - standoff) / found.sigma_mm[0])
    z = np.array(scores).reshape(24, -1)
    # Errors of one rig are correlated: 24 independent groups bound the mean square to sqrt(2 / 24) = 0.29.
    assert (z**2).mean() == pytest.approx(1.0, abs=3 * 0.29)
    assert (np.abs(z) < 1.96).mean() > 0.85


def test_out_of_the_frame(sensor: Sensor) -> None:
    inside = sensor.in_frame("L4", np.array([40.0, 500.0]))
    assert inside.tolist() == [False, True]
