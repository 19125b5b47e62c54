"""Verdict of a verification on sensors drawn from a calibration's covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.support.drawn_sensors import drawn_sensor, flat_readings
from tests.support.four_lasers import reading
from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.procedure.engine.step import flat_placement
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import PlacementCheck, check_placement
from workbench.trials.verify.verdict import Verdict, lasers_verdict, ranges_verdict

STANDOFFS_MM = (200.0, 300.0, 500.0, 800.0, 1200.0, 2000.0)
PLACEMENT_SD_MM = 0.3
READINGS = 5
SENSOR = thesis_ranger().sensor
BENCH = thesis_rig().bench


def verification(
    change: Mapping[str, float], seed: int, *, same_bench: bool = True
) -> tuple[Verdict, Verdict]:
    """Verdicts on the lasers and on the ranges, of a sensor that has changed since its calibration."""
    one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed, change, same_bench)
    checks = [
        check_placement(SENSOR, one.spot_readings("v", flat_placement("v", mm), READINGS), sd_mm)
        for mm, sd_mm in ((600.0, 600.0), *((mm, PLACEMENT_SD_MM) for mm in STANDOFFS_MM))
    ]
    reference = (Reference.of_calibration if same_bench else Reference.own)(SENSOR, BENCH)
    return lasers_verdict(checks[0]), ranges_verdict(SENSOR, reference, checks)


def refused(change: Mapping[str, float], trials: int, *, same_bench: bool = True) -> int:
    found = [verification(change, seed, same_bench=same_bench) for seed in range(trials)]
    return sum(not all(one.valid for one in verdicts) for verdicts in found)


@pytest.mark.parametrize("same_bench", [True, False])
def test_valid_calibrations_are_refused_in_one_of_twenty_at_most(same_bench: bool) -> None:
    """Of 60 trials at 5 %, more than 9 occur with a probability of 1e-3."""
    assert refused({}, 60, same_bench=same_bench) <= 9


@pytest.mark.parametrize(
    ("change", "same_bench"),
    [
        ({"L2.tx": 0.001}, False),
        ({"L3.tx": -0.001}, False),
        ({"cx_px": 1.07}, False),
        ({"f_px": 0.003 * 533.0}, True),
        ({"f_px": 0.005 * 533.3, "offset_mm": 2.0}, True),
        ({"f_px": 0.005 * 533.3, "offset_mm": 2.0}, False),
    ],
)
def test_changes_that_move_ranges_are_found(change: dict[str, float], same_bench: bool) -> None:
    """Of 30 trials; 23 or fewer of 95 % occur with a probability of 7e-4."""
    assert refused(change, 30, same_bench=same_bench) > 23


def test_a_turned_laser_is_found_before_a_target_is_measured() -> None:
    lasers, _ = verification({"L2.tx": 0.002}, 1)
    assert not lasers.valid


def test_a_ruler_that_is_long_looks_like_a_change_only_where_it_is_that_of_the_calibration() -> None:
    """0.15 % (3 sd of the ruler) is within the uncertainty of the baselines and another ruler together."""
    checks = [_long_ruler(mm, 1.0015) for mm in STANDOFFS_MM]
    own, same = (make(SENSOR, BENCH) for make in (Reference.own, Reference.of_calibration))
    assert ranges_verdict(SENSOR, own, checks).valid
    assert not ranges_verdict(SENSOR, same, checks).valid


def test_one_laser_can_be_verified() -> None:
    calibration = thesis_ranger().calibration
    random = np.random.default_rng(3)
    readings = [
        [
            one.model_copy(update={"lasers": one.lasers[:1]})
            for one in flat_readings(SENSOR, mm, 3, random, 0.3)
        ]
        for mm in STANDOFFS_MM
    ]
    turned = drawn_sensor(calibration, np.random.default_rng(3), {"L1.tx": 0.004})
    wrong = [
        [
            one.model_copy(update={"lasers": one.lasers[:1]})
            for one in flat_readings(turned, mm, 3, random, 0.3)
        ]
        for mm in STANDOFFS_MM
    ]
    reference = Reference.own(SENSOR, BENCH)
    verdicts = [
        # As of a sensor with one laser, of which none is missing.
        ranges_verdict(
            SENSOR, reference, [replace(check_placement(SENSOR, each, 0.3), missing=()) for each in one]
        )
        for one in (readings, wrong)
    ]
    assert [one.valid for one in verdicts] == [True, False]


def test_without_any_spot_the_verdict_names_no_range() -> None:
    check = check_placement(SENSOR, [reading(None)], 0.3)
    assert not lasers_verdict(check).valid
    assert not ranges_verdict(SENSOR, Reference.own(SENSOR, BENCH), [check]).valid


def _long_ruler(standoff_mm: float, factor: float) -> PlacementCheck:
    """Noise-free check at a standoff read off a ruler whose marks lie too far apart."""
    sensor = CalibratedSensor(thesis_ranger().calibration)
    exact = sensor.calibration.laser_ranger.noise.model_copy(
        update={"speckle_sd_px": 0.0, "spot_sd_px": 1e-9}
    )
    ideal = sensor.calibration.model_copy(
        update={"laser_ranger": sensor.calibration.laser_ranger.model_copy(update={"noise": exact})}
    )
    taken = flat_readings(CalibratedSensor(ideal), standoff_mm * factor, 1, np.random.default_rng(0), 0.0)
    return check_placement(
        sensor, [one.model_copy(update={"standoff_mm": standoff_mm}) for one in taken], PLACEMENT_SD_MM
    )


def without(laser_id: str, standoff_mm: float, sd_mm: float) -> PlacementCheck:
    """Check of a placement at which a laser has no range."""
    one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1, {}, same_bench=False)
    taken = one.spot_readings("v", flat_placement("v", standoff_mm), READINGS)
    left = [
        each.model_copy(update={"lasers": tuple(r for r in each.lasers if r.laser_id != laser_id)})
        for each in taken
    ]
    return check_placement(SENSOR, left, sd_mm)


def test_a_laser_that_has_no_range_makes_no_calibration_valid() -> None:
    """A laser knocked so far that its spot is on no line leaves the others in agreement."""
    unmeasured, *measured = [
        without("L3", mm, 600.0 if mm == 600.0 else 0.3) for mm in (600.0, *STANDOFFS_MM)
    ]
    assert all(one.missing == ("L3",) for one in (unmeasured, *measured))
    assert "L3" in lasers_verdict(unmeasured).text
    verdict = ranges_verdict(SENSOR, Reference.own(SENSOR, BENCH), measured, [unmeasured])
    assert not verdict.valid
    assert "L3" in verdict.text


@pytest.mark.parametrize(
    ("standoff_mm", "missing"), [(40.0, False), (70.0, False), (100.0, True), (5000.0, False)]
)
def test_a_spot_out_of_the_picture_or_the_calibrated_range_is_not_missed(
    standoff_mm: float, missing: bool
) -> None:
    """Of a calibration from 50 to 4500 mm, whose outer spots leave the picture below 80 mm."""
    calibration = SENSOR.calibration
    validity = calibration.laser_ranger.validity.model_copy(update={"standoff_mm": (50.0, 4500.0)})
    ranger = calibration.laser_ranger.model_copy(update={"validity": validity})
    sensor = CalibratedSensor(calibration.model_copy(update={"laser_ranger": ranger}))
    none = reading(None).model_copy(update={"standoff_mm": standoff_mm})
    assert ("L1" in check_placement(sensor, [none], 0.3).missing) == missing


def test_without_a_measured_placement_nothing_is_verified() -> None:
    one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1, {}, same_bench=False)
    taken = one.spot_readings("v", flat_placement("v", 600.0), READINGS)
    unmeasured = check_placement(SENSOR, taken, 600.0)
    assert lasers_verdict(unmeasured).valid
    assert not ranges_verdict(SENSOR, Reference.own(SENSOR, BENCH), [], [unmeasured]).valid
