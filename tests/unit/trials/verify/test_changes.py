"""Changes of a sensor that a verification names, on sensors drawn from a calibration's covariance."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.drawn_sensors import drawn_sensor, flat_readings
from tests.support.rangers import thesis_ranger
from tests.support.rigs import prior, thesis_rig
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.changes import Change, changes, named
from workbench.trials.verify.laser_errors import laser_errors
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import check_placement

STANDOFFS_MM = (200.0, 300.0, 500.0, 800.0, 1200.0, 2000.0)
PLACEMENT_SD_MM = 0.3
BENCH = thesis_rig().bench.model_copy(
    update={"tilt_sd_deg": 0.0, "target_tilt_sd_deg": 0.0, "ruler_scale": prior(0.0, 0.0)}
)
RUNS = 12


@cache
def sensor() -> CalibratedSensor:
    return thesis_ranger().sensor


def found(change: Mapping[str, float], seed: int) -> list[Change]:
    random = np.random.default_rng([77, seed])
    true = drawn_sensor(thesis_ranger().calibration, random, change)
    checks = [
        check_placement(sensor(), flat_readings(true, mm, 5, random, PLACEMENT_SD_MM), PLACEMENT_SD_MM)
        for mm in STANDOFFS_MM
    ]
    return changes(sensor(), laser_errors(Reference.own(sensor(), BENCH), checks))


@pytest.mark.parametrize(
    ("change", "parameter", "amount"),
    [
        ({"L2.tx": 0.001}, "L2.tx", 1.0),
        ({"L1.tx": -0.001}, "L1.tx", -1.0),
        ({"L3.x_mm": 0.3}, "L3.x_mm", 0.3),
        ({"cx_px": 1.07}, "cx_px", 2.0),
        ({"f_px": 0.01 * 533.3}, "f_px", 1.0),
    ],
)
def test_the_changed_parameter_is_named_with_its_amount(
    change: dict[str, float], parameter: str, amount: float
) -> None:
    """At most 2 of 12 may fail where 1 of 40 does; the sd of an amount is as stated."""
    best = [found(change, seed)[0] for seed in range(RUNS)]
    right = [one for one in best if parameter in one.parameters]
    assert len(right) >= RUNS - 2
    z = [(one.amount - amount) / one.sd for one in right if one.parameters == (parameter,)]
    assert np.mean(z) == pytest.approx(0.0, abs=5 / np.sqrt(max(len(z), 1)))


def test_a_refocused_lens_is_named() -> None:
    """Focal length and pinhole change together."""
    texts = [named(found({"f_px": 0.01 * 533.3, "offset_mm": 4.0}, seed)) for seed in range(RUNS)]
    assert sum("refocused" in text for text in texts) >= RUNS - 2


def test_an_unchanged_sensor_names_hardly_any_change() -> None:
    """Some ten changes with a probability of 1 / 600 each: 3 of 40 occur with a probability of 2 %."""
    assert sum(named(found({}, seed)) != "" for seed in range(40)) <= 3


def test_two_changes_are_explained_by_no_single_one() -> None:
    texts = {named(found({"L2.tx": 0.003, "L4.tx": -0.004}, seed)) for seed in range(4)}
    assert texts == {"no single change of the sensor explains the errors"}


def test_the_p_value_is_that_of_the_gain() -> None:
    alone = [one for one in found({"L2.tx": 0.0001}, 1) if len(one.parameters) == 1]
    assert len(alone) > 8
    for one in alone:
        assert one.p == pytest.approx(chi2.sf(one.gain, 1))


def test_without_errors_there_is_no_change() -> None:
    assert changes(sensor(), None) == []
    assert named([]) == ""
