"""Verification on sensors drawn from a calibration's covariance: few false alarms, changes are found."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from tests.support.drawn_sensors import drawn_sensor, flat_readings
from tests.support.four_lasers import reading
from tests.support.rangers import thesis_ranger
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.statistics import (
    Verdict,
    check_placement,
    lasers_verdict,
    predicted_mm,
    range_verdict,
    scale_score,
)

STANDOFFS_MM = (200.0, 300.0, 500.0, 800.0, 1200.0, 2000.0)
PLACEMENT_SD_MM = 0.3
READINGS = 5
VISITED = 1 + len(STANDOFFS_MM)


def verification(change: Mapping[str, float], seed: int) -> tuple[Verdict, Verdict]:
    """Verdicts on the lasers and on the ranges, of a sensor that has changed since its calibration."""
    calibration = thesis_ranger().calibration
    random = np.random.default_rng([2001, seed])
    true, ours = drawn_sensor(calibration, random, change), CalibratedSensor(calibration)

    checks = {
        standoff_mm: check_placement(
            ours, flat_readings(true, standoff_mm, READINGS, random, PLACEMENT_SD_MM), PLACEMENT_SD_MM
        )
        for standoff_mm in (600.0, *STANDOFFS_MM)
    }
    lasers = [lasers_verdict(check, VISITED) for check in checks.values()]
    failed = next((one for one in lasers if not one.valid), lasers[0])
    return failed, range_verdict(ours, [checks[mm] for mm in STANDOFFS_MM])


def refused(change: Mapping[str, float], trials: int) -> int:
    return sum(not all(one.valid for one in verification(change, seed)) for seed in range(trials))


def test_valid_calibrations_are_refused_in_one_of_twenty_at_most() -> None:
    """Of 200 trials at 5 %, more than 20 occur with a probability of 1e-3."""
    assert refused({}, 200) <= 20


@pytest.mark.parametrize(
    "change",
    [{"L2.tx": 0.001}, {"L2.tx": -0.001}, {"L3.tx": 0.001}, {"f_px": 0.003 * 533.0}, {"cx_px": 1.07}],
)
def test_changes_that_move_ranges_are_found(change: dict[str, float]) -> None:
    """Of 60 trials; 51 or fewer of 95 % occur with a probability of 5e-4."""
    assert refused(change, 60) > 51


def test_a_turned_laser_is_found_before_a_target_is_measured() -> None:
    lasers, _ = verification({"L2.tx": 0.002}, 1)
    assert not lasers.valid


def test_the_predicted_error_contains_calibration_spots_and_reference() -> None:
    sensor = thesis_ranger().sensor
    random = np.random.default_rng(4)
    readings = flat_readings(sensor, 500.0, READINGS, random, 0.0)
    exact, placed = (check_placement(sensor, readings, sd_mm) for sd_mm in (0.0, 2.0))
    assert predicted_mm(sensor, placed) ** 2 == pytest.approx(predicted_mm(sensor, exact) ** 2 + 16.0)
    calibration_mm = 2 * np.sqrt(exact.by_parameter @ sensor.covariance @ exact.by_parameter)
    assert predicted_mm(sensor, exact) > calibration_mm


def test_an_error_in_proportion_to_the_range_is_a_change_of_scale() -> None:
    standoffs_mm = np.array([300.0, 600.0, 900.0])
    covariance = np.diag([1.0, 4.0, 9.0])
    score = scale_score(0.01 * standoffs_mm, covariance, standoffs_mm)
    assert score == pytest.approx(0.01 / np.sqrt(1 / np.sum(standoffs_mm**2 / np.diag(covariance))))
    assert scale_score(np.array([3.0, 0.0, -9.0]), covariance, standoffs_mm) == pytest.approx(0.0)


def test_without_any_spot_the_verdict_names_no_range() -> None:
    sensor = thesis_ranger().sensor
    check = check_placement(sensor, [reading(None)], 0.3)
    assert check.error_mm is None
    assert not lasers_verdict(check, 1).valid
    assert not range_verdict(sensor, [check]).valid
