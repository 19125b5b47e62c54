"""Tables of a verification."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.drawn_sensors import flat_readings
from tests.support.rangers import thesis_ranger
from tests.support.rigs import prior, thesis_rig
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.changes import Change
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import check_placement, predicted_mm
from workbench.trials.verify.tables import change_table, nearest_cross_validation, verify_tables
from workbench.trials.verify.verdict import Verdict

SENSOR = thesis_ranger().sensor
REFERENCE = Reference.own(SENSOR, thesis_rig().bench)
VERDICT = Verdict(True, "the ranges agree", "keep the calibration")
READINGS = [flat_readings(SENSOR, mm, 3, np.random.default_rng(1), 0.3) for mm in (300.0, 1000.0)]
CHECKS = [check_placement(SENSOR, readings, 0.3) for readings in READINGS]


def test_the_verdict_comes_first_and_errors_stand_beside_cross_validation() -> None:
    first, errors = verify_tables("v.1", SENSOR, (REFERENCE, CHECKS), VERDICT)
    assert (first.name, errors.name) == ("v.1-verdict", "v.1")
    rows = errors.records()
    assert [row["cross_validated_at_mm"] for row in rows] == [280.0, 900.0]
    validated = {one.standoff_mm: one for one in SENSOR.calibration.laser_ranger.fit.cross_validation}
    assert rows[0]["cross_validated_mm"] == validated[280.0].error_mm
    assert rows[0]["expanded_mm"] == pytest.approx(predicted_mm(REFERENCE, CHECKS[0]))


def test_errors_by_another_calibration_stand_beside() -> None:
    """The other calibration has a focal length longer by 1 %, and another ruler."""
    geometry = SENSOR.calibration.geometry()
    other = CalibratedSensor(SENSOR.calibration, {"f_px": 1.01 * geometry["f_px"]})
    bench = thesis_rig().bench.model_copy(update={"ruler_scale": prior(0.001, 0.002)})
    reference = Reference.own(other, bench)
    checks = [check_placement(other, readings, 0.3) for readings in READINGS]
    _, errors = verify_tables("v.1", SENSOR, (REFERENCE, CHECKS), VERDICT, (reference, checks))
    for row, own, by_other in zip(errors.records(), CHECKS, checks, strict=True):
        assert row["error_mm"] == own.error_mm(REFERENCE)
        assert row["expanded_mm"] == predicted_mm(REFERENCE, own)
        assert row["other_error_mm"] == by_other.error_mm(reference)
        assert row["other_expanded_mm"] == predicted_mm(reference, by_other)
        assert by_other.error_mm(reference) == pytest.approx(0.009 * own.standoff_mm, rel=0.3)


def test_a_calibration_without_cross_validation_has_empty_cells() -> None:
    own = SENSOR.calibration.laser_ranger
    fit = own.fit.model_copy(update={"cross_validation": ()})
    old = SENSOR.calibration.model_copy(update={"laser_ranger": own.model_copy(update={"fit": fit})})
    assert nearest_cross_validation(old, 300.0) is None


def test_the_best_changes_are_listed() -> None:
    found = [Change(f"L{n} turned", (f"L{n}.tx",), 1.0, 0.1, "mrad", 50.0 - n, 1e-9, 0.5) for n in range(9)]
    table = change_table("v.1", found)
    assert [row["change"] for row in table.records()] == [f"L{n} turned" for n in range(5)]
