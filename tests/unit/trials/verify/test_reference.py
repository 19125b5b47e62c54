"""Ruler and rail of a verification."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from workbench.model.errors import BadInputError
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.reference import SHARED, Reference

SENSOR = thesis_ranger().sensor
BENCH = thesis_rig().bench
COUNT = len(SENSOR.covariance)


def test_an_own_bench_is_independent_of_the_calibration() -> None:
    own = Reference.own(SENSOR, BENCH)
    np.testing.assert_array_equal(own.covariance[:COUNT, :COUNT], SENSOR.covariance)
    assert not own.covariance[COUNT:, :COUNT].any()
    sd = np.sqrt(np.diag(own.covariance)[COUNT:])
    np.testing.assert_allclose(sd, [0.0005, np.radians(0.5), np.radians(0.5)])
    assert own.shared.tolist() == [0.0, 0.0, 0.0]


def test_the_bench_of_the_calibration_is_as_the_calibration_knows_it() -> None:
    same = Reference.of_calibration(SENSOR, BENCH)
    parameters = SENSOR.calibration.laser_ranger.parameters
    index = [parameters.names.index(name) for name in SHARED]
    assert same.shared.tolist() == [parameters.values[n] for n in index]
    np.testing.assert_array_equal(same.covariance[COUNT:, :COUNT], SENSOR.covariance[index])


def test_the_scale_of_one_ruler_cancels() -> None:
    """All ranges in proportion: calibration and ruler together are better known than either alone."""
    ranges = SENSOR.typical_ranges("L1", np.array([1000.0]))
    place = np.array([[1000.0, 0.0, 0.0]])
    variances = []
    for reference in (Reference.own(SENSOR, BENCH), Reference.of_calibration(SENSOR, BENCH)):
        gradient = reference.gradient(ranges.by_parameter, place)[0]
        variances.append(gradient @ reference.covariance @ gradient)
    calibration = ranges.by_parameter[0] @ SENSOR.covariance @ ranges.by_parameter[0]
    assert variances[0] == pytest.approx(calibration + 0.5**2)
    assert variances[1] < calibration


def test_a_calibration_without_its_bench_is_refused() -> None:
    own = SENSOR.calibration.laser_ranger
    names = tuple(name.replace("ruler_scale", "other") for name in own.parameters.names)
    parameters = own.parameters.model_copy(update={"names": names})
    old = SENSOR.calibration.model_copy(
        update={"laser_ranger": own.model_copy(update={"parameters": parameters})}
    )
    with pytest.raises(BadInputError) as caught:
        Reference.of_calibration(CalibratedSensor(old), BENCH)
    assert caught.value.exit_code == 2
