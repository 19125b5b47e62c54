"""Tilt of the target's mount from inclines, on sensors drawn from a calibration's covariance."""

from __future__ import annotations

from functools import cache
from math import atan, degrees

import numpy as np
import pytest

from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
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
