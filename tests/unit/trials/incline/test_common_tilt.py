"""Tilt of the target's mount from inclines, on sensors drawn from a calibration's covariance."""

from __future__ import annotations

from functools import cache
from math import atan, degrees

import numpy as np
import pytest

from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.model.arrays import FloatArray
from workbench.model.target import FlatTarget
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.incline.common_tilt import CommonTilt, InclinePoints, common_tilts
from workbench.trials.target_check import Points
from workbench.trials.targets import InclineSpec, target_placement

SENSOR = thesis_ranger().sensor
RUNS = 40


@cache
def measured(angles_deg: tuple[float, ...]) -> tuple[list[CommonTilt], list[float]]:
    """Estimates and true tilts of `RUNS` benches, with inclines at 200 and 500 mm."""
    found, true = [], []
    for seed in range(RUNS):
        one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed, same_bench=True)
        set_ups = []
        for angle_deg in angles_deg:
            spec = InclineSpec(kind="incline", angle_deg=angle_deg)
            for range_mm in (200.0, 500.0):
                placement = target_placement(spec, "t", range_mm, one.rig)
                points = Points.of(SENSOR, one.spot_readings("t", placement, 5))
                assert points is not None
                set_ups.append(InclinePoints(spec, points))
        (tilt,) = common_tilts(SENSOR, set_ups, one.rig.bench)
        found.append(tilt)
        true.append(degrees(atan(one.tilt[0])))
    return found, true


@pytest.mark.parametrize("angles_deg", [(30.0, 60.0), (-60.0, 60.0)])
def test_the_tilt_lies_in_its_interval(angles_deg: tuple[float, ...]) -> None:
    """40 runs: the sd of a mean z is 0.16, that of a mean square 0.22."""
    found, true = measured(angles_deg)
    z = np.array([(one.tilt_deg - tilt) / one.sd_deg for one, tilt in zip(found, true, strict=True)])
    assert z.mean() == pytest.approx(0.0, abs=4 * 0.16)
    assert (z**2).mean() == pytest.approx(1.0, abs=4 * 0.22)
    assert all(one.is_measured and "target_yaw_deg" in one.rig_keys for one in found)


def errors_with_common_angles(reference_sd_deg: float, runs: int) -> FloatArray:
    """(runs,) z of the tilts of benches whose angle of 60 deg is set once for four ranges."""
    z = []
    spec = InclineSpec(kind="incline", angle_deg=60.0, reference_sd_deg=reference_sd_deg)
    for seed in range(runs):
        one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed, same_bench=True)
        yaw_deg = spec.angle_deg + one.random.normal(0.0, reference_sd_deg)
        set_ups = []
        for range_mm in (125.0, 250.0, 500.0, 1000.0):
            placement = target_placement(spec, "t", range_mm, one.rig)
            turned = FlatTarget(yaw_deg=yaw_deg, turn_sd_deg=0.0)
            placement = placement.model_copy(update={"target": turned})
            points = Points.of(SENSOR, one.spot_readings("t", placement, 5))
            assert points is not None
            set_ups.append(InclinePoints(spec, points))
        (tilt,) = common_tilts(SENSOR, set_ups, one.rig.bench)
        z.append((tilt.tilt_deg - degrees(atan(one.tilt[0]))) / tilt.sd_deg)
    return np.array(z)


@pytest.mark.parametrize("reference_sd_deg", [0.3, 0.5])
def test_the_error_of_an_angle_is_common_to_its_ranges(reference_sd_deg: float) -> None:
    """100 runs: the sd of a mean square is 0.14. With independent errors it would be 1.7."""
    z = errors_with_common_angles(reference_sd_deg, 100)
    assert (z**2).mean() == pytest.approx(1.0, abs=4 * 0.14)
    assert abs(z.mean()) < 4 * 0.1


def test_large_angles_on_both_sides_determine_it_best() -> None:
    designs = ((1.0,), (30.0, 60.0), (-60.0, 60.0))
    flat, one_side, two_sides = (measured(angles)[0][0] for angles in designs)
    assert flat.known_sd_deg > flat.sd_deg > one_side.sd_deg > two_sides.sd_deg
    assert two_sides.sd_deg < 0.6 * two_sides.known_sd_deg


def test_an_estimate_that_adds_nothing_gives_no_keys() -> None:
    assert CommonTilt("vertical", 0.2, 0.29, 0.31).rig_keys == ""
    assert "target_pitch_deg: -0.20" in CommonTilt("horizontal", -0.2, 0.1, 0.31).rig_keys


def test_a_calibration_without_a_tilt_has_no_estimate() -> None:
    own = SENSOR.calibration.laser_ranger
    names = tuple(name.replace("target_slope", "other") for name in own.parameters.names)
    parameters = own.parameters.model_copy(update={"names": names})
    old = SENSOR.calibration.model_copy(
        update={"laser_ranger": own.model_copy(update={"parameters": parameters})}
    )
    assert common_tilts(CalibratedSensor(old), [], thesis_rig().bench) == []
