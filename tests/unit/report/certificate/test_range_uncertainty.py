"""Range uncertainty: of lasers as the sensor states it, of their mean from the full covariance."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.reference_session import record
from workbench.model.calibration import Calibration
from workbench.report.certificate.range_uncertainty import (
    ROUND_MM,
    curve_mm,
    range_uncertainties,
    table_mm,
    uncertainty_chart,
    uncertainty_table,
)
from workbench.sensor.calibrated import CalibratedSensor


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    found = record().calibration
    assert found is not None
    return found


def test_uncertainty_of_a_laser_is_that_of_the_sensor(calibration: Calibration) -> None:
    (one,) = range_uncertainties(calibration, [500.0])
    sensor = CalibratedSensor(calibration)
    for laser_id in sensor.ids:
        expected = sensor.typical_ranges(laser_id, np.array([500.0])).sigma_mm[0]
        assert one.laser_sd_mm[laser_id] == pytest.approx(expected)
    assert one.inside


def test_uncertainty_of_the_mean_holds_for_drawn_sensors(calibration: Calibration) -> None:
    """Parameters and spots are drawn; the mean of the lasers, weighted by their spots, scatters as stated."""
    (one,) = range_uncertainties(calibration, [500.0])
    sensor = CalibratedSensor(calibration)
    at = np.array([500.0])
    spots = np.concatenate([sensor.spot_px(i, at) for i in sensor.ids])
    found = sensor.ranges(sensor.ids, spots, np.full_like(spots, np.nan))
    weight = 1 / found.spot_sd_mm**2
    weight /= weight.sum()
    random, draws = np.random.default_rng(5), 4000
    parameters = random.multivariate_normal(np.zeros(len(sensor.covariance)), sensor.covariance, draws)
    noise = random.normal(0, found.spot_sd_mm, (draws, len(sensor.ids)))
    means = (parameters @ found.by_parameter.T + noise) @ weight
    assert one.mean_sd_mm == pytest.approx(means.std(), rel=4 / np.sqrt(2 * draws))


def test_the_table_contains_both_ends_of_the_certified_span(calibration: Calibration) -> None:
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    found = {one.range_mm: one for one in range_uncertainties(calibration, table_mm(calibration))}
    assert list(found) == sorted(found)
    assert found[nearest].inside
    assert found[farthest].inside
    assert farthest not in ROUND_MM
    assert not found[100].inside


def test_ranges_outside_the_standoffs_are_marked(calibration: Calibration) -> None:
    found = range_uncertainties(calibration, table_mm(calibration))
    table = uncertainty_table(found)
    remarks = {row["range_mm"]: row["remark"] for row in table.records()}
    assert remarks[100] == remarks[5000] == "extrapolated"
    assert remarks[500] == ""
    expanded = {row["range_mm"]: row["mean_expanded_mm"] for row in table.records()}
    assert expanded[500] == pytest.approx(
        next(2 * f.mean_sd_mm for f in found if f.range_mm == 500 and f.mean_sd_mm)
    )
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    at = curve_mm(calibration)
    assert [at[0], at[-1]] == pytest.approx([nearest, farthest])
    assert len(uncertainty_chart(range_uncertainties(calibration, at)).series[0].x) == len(at)
