"""The calibrated sensor: spots to ranges, and the truth of the stated deviations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE, World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.sensor.calibrated import CalibratedSensor

STANDOFFS_MM = np.array([120.0, 200.0, 350.0, 700.0, 1300.0, 2500.0, 5000.0])


def sensor_of(seed: int) -> tuple[CalibratedSensor, World]:
    world = World(thesis_rig(), seed)
    fitted = fit(world.rig, world.observations())
    return CalibratedSensor(calibrate(fitted, Acceptance(), PROVENANCE)[0]), world


@pytest.fixture(scope="module")
def sensor() -> CalibratedSensor:
    return sensor_of(1)[0]


@pytest.mark.parametrize("laser_id", ["L1", "L3"])
def test_spots_and_ranges_are_inverse(sensor: CalibratedSensor, laser_id: str) -> None:
    spots = sensor.spot_px(laser_id, STANDOFFS_MM)
    found = sensor.ranges([laser_id] * len(spots), spots, np.full_like(spots, 0.05))
    np.testing.assert_allclose(found.range_mm, STANDOFFS_MM, rtol=1e-9)
    np.testing.assert_allclose(found.misfit_sd, 0.0, atol=1e-6)


def test_a_spot_beyond_infinity_has_no_range(sensor: CalibratedSensor) -> None:
    far = sensor.spot_px("L4", np.array([np.inf]))
    found = sensor.ranges(["L4"], far - [5.0, 0.0], np.full((1, 2), 0.05))
    assert not np.isfinite(found.range_mm[0])


def test_the_covariance_is_the_scatter_of_drawn_calibrations(sensor: CalibratedSensor) -> None:
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


def test_speckle_stays_in_every_range(sensor: CalibratedSensor) -> None:
    spot = sensor.spot_px("L4", np.array([1000.0]))
    sharp = sensor.ranges(["L4"], spot, np.full((1, 2), 1e-9)).spot_sd_mm[0]
    f_b = sensor.calibration.geometry()["f_px"] * sensor.calibration.geometry()["L4.x_mm"]
    # A pinhole's r^2 / (f b) on the 0.04 px of the speckle; the lens bends it by a per cent or two.
    assert sharp == pytest.approx(0.04 * 1000.0**2 / f_b, rel=0.05)


def test_the_speckle_of_a_spot_replaces_that_of_the_calibration(sensor: CalibratedSensor) -> None:
    spot, sd = sensor.spot_px("L4", np.array([1000.0])), np.full((1, 2), 1e-9)
    file = sensor.calibration.laser_ranger
    typical = sensor.ranges(["L4"], spot, sd).spot_sd_mm[0]
    unknown = sensor.ranges(["L4"], spot, sd, np.full((1, 2), np.nan)).spot_sd_mm[0]
    assert unknown == typical
    own = sensor.ranges(["L4"], spot, sd, np.full((1, 2), 0.08)).spot_sd_mm[0]
    expected = 0.08 * file.fit.noise_scale / file.noise.speckle_sd_px
    assert own / typical == pytest.approx(expected, rel=1e-6)


@pytest.mark.thorough
def test_ranges_of_unseen_standoffs_lie_where_stated() -> None:
    """40 rigs: errors of ranges at standoffs that the fits did not see, whitened by their covariance."""
    seen = [(i, r) for i in ("L1", "L2", "L3", "L4") for r in (180.0, 750.0, 1800.0)]
    distance2 = 0.0
    for seed in range(200, 240):
        sensor, world = sensor_of(seed)
        spots = np.array([world.pixel(i, r + world.values["offset_mm"]) for i, r in seen])
        noise = np.random.default_rng([seed, 9]).normal(0.0, 0.05, spots.shape)
        own = np.full_like(spots, 0.03)  # with the speckle's 0.04 px: 0.05
        found = sensor.ranges([i for i, _ in seen], spots + noise, own)
        error = found.range_mm - np.array([r for _, r in seen])
        distance2 += float(error @ np.linalg.solve(found.covariance_mm2, error))
    # Chi-square of 40 x 12 degrees of freedom: known to sqrt(2 / 480) = 6.5 %.
    assert distance2 / 480 == pytest.approx(1.0, abs=3.5 * 0.065)


def test_out_of_the_frame(sensor: CalibratedSensor) -> None:
    inside = sensor.in_frame("L4", np.array([40.0, 500.0]))
    assert inside.tolist() == [False, True]
