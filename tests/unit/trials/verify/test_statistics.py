"""Mean ranges at one placement of a verification."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.drawn_sensors import flat_readings
from tests.support.four_lasers import reading
from tests.support.rangers import thesis_ranger
from tests.support.rigs import prior, thesis_rig
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import check_placement, predicted_mm

BENCH = thesis_rig().bench
READINGS = 5


def test_the_predicted_error_contains_calibration_spots_and_standoff() -> None:
    sensor = thesis_ranger().sensor
    readings = flat_readings(sensor, 500.0, READINGS, np.random.default_rng(4), 0.0)
    reference = Reference.own(sensor, BENCH)
    exact, placed = (check_placement(sensor, readings, sd_mm) for sd_mm in (0.0, 2.0))
    assert predicted_mm(reference, placed) ** 2 == pytest.approx(predicted_mm(reference, exact) ** 2 + 16.0)
    gradient = exact.weight @ exact.by_parameter
    assert predicted_mm(reference, exact) > 2 * np.sqrt(gradient @ sensor.covariance @ gradient)


def test_the_scale_of_another_ruler_adds_to_the_prediction() -> None:
    """0.05 % of 2000 mm is 1 mm; tilts about the axis of symmetry add next to nothing."""
    sensor = thesis_ranger().sensor
    check = check_placement(sensor, flat_readings(sensor, 2000.0, 1, np.random.default_rng(1), 0.0), 0.3)
    exact = BENCH.model_copy(update={"ruler_scale": BENCH.ruler_scale.model_copy(update={"sd": 0.0})})
    squares = [predicted_mm(Reference.own(sensor, bench), check) ** 2 for bench in (exact, BENCH)]
    assert squares[1] - squares[0] == pytest.approx(4.0)


def test_the_mean_range_is_weighted_by_the_spots() -> None:
    sensor = thesis_ranger().sensor
    check = check_placement(
        sensor, flat_readings(sensor, 500.0, READINGS, np.random.default_rng(4), 0.3), 0.3
    )
    assert check.weight.sum() == pytest.approx(1.0)
    assert check.weight[0] > check.weight[1]  # the longer baseline
    assert check.error_mm(Reference.own(sensor, BENCH)) == pytest.approx(0.0, abs=5 * 0.5)
    assert check.by_shared[:, 0].tolist() == [500.0] * 4
    np.testing.assert_allclose(check.by_shared[:, 1], [-60, -30, 30, 60], atol=12.0)


def test_without_any_spot_there_is_no_range() -> None:
    sensor = thesis_ranger().sensor
    check = check_placement(sensor, [reading(None)], 0.3)
    error_mm = check.error_mm(Reference.own(sensor, BENCH))
    assert (check.readings, check.range_mm, error_mm, check.lasers_p) == (0, None, None, None)


def test_the_error_is_from_the_true_range_not_from_the_ruler_s() -> None:
    """A ruler that is short by 0.3 %, and a rail that turns the target by 2 deg, as the rig file states."""
    sensor = thesis_ranger().sensor
    check = check_placement(sensor, flat_readings(sensor, 1000.0, 1, np.random.default_rng(1), 0.0), 0.3)
    bench = BENCH.model_copy(update={"ruler_scale": prior(0.003, 0.0005), "target_yaw_deg": 2.0})
    stated, ideal = (check.error_mm(Reference.own(sensor, one)) for one in (bench, BENCH))
    assert stated is not None
    assert ideal is not None
    turned_mm = np.tan(np.radians(2.0)) * float(check.weight @ check.place_mm[:, 0])
    assert ideal - stated == pytest.approx(3.0 + turned_mm)
