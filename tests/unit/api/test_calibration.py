"""Calibrations of the public interface, against the command's files and the ranger."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "data/session-0.1.0"
ROWS, RIG = ROOT / "data/webcam-laser-rows.csv", ROOT / "rigs/webcam-laser.yaml"


@pytest.fixture(scope="module")
def calibration() -> wb.Calibration:
    return wb.load_calibration(FOLDER / "calibration.yaml")


@pytest.fixture(scope="module")
def fitted() -> wb.Calibration:
    return wb.fit(ROWS, RIG)


def test_fit_of_readings_agrees_with_least_squares(fitted: wb.Calibration) -> None:
    """As in data/README.md: row = A + B / distance, A = 203.61 +- 0.46 px, B = -32478 +- 185 px mm."""
    value = fitted.parameters["value"]
    assert value["f_px"] * value["1.y_mm"] == pytest.approx(-32478, abs=185)
    assert value["cy_px"] + value["f_px"] * value["1.ty"] == pytest.approx(203.61, abs=0.46)


def test_fit_of_a_data_frame_is_that_of_the_file(fitted: wb.Calibration) -> None:
    again = wb.fit(pd.read_csv(ROWS), str(RIG))
    pd.testing.assert_frame_equal(again.parameters, fitted.parameters)


def test_fixed_parameter_keeps_its_prior(fitted: wb.Calibration) -> None:
    fixed = wb.fit(ROWS, RIG, fix=["f_px"])
    assert fixed.parameters["value"]["f_px"] == 650.0
    assert fixed.parameters["sd"]["f_px"] == 0.0
    assert fitted.parameters["sd"]["f_px"] > 0.0


def test_saved_calibration_reads_back(fitted: wb.Calibration, tmp_path: Path) -> None:
    fitted.save(tmp_path / "c.yaml")
    again = wb.load_calibration(str(tmp_path / "c.yaml"))
    assert again == fitted
    assert wb.compare(fitted, again).identical


def test_covariance_is_labelled_and_agrees_with_sd(calibration: wb.Calibration) -> None:
    assert list(calibration.covariance.index) == list(calibration.parameters.index)
    sd = np.sqrt(np.diag(calibration.covariance))
    np.testing.assert_allclose(sd, calibration.parameters["sd"], rtol=1e-9)


def test_range_uncertainty_is_that_of_the_sensor(calibration: wb.Calibration) -> None:
    table = calibration.range_uncertainty([400, 1500]).set_index(["laser_id", "range_mm"])["sd_mm"]
    sensor = CalibratedSensor(calibration.file)
    for laser_id in sensor.ids:
        expected = sensor.relative_range_sd(laser_id, np.array([400.0, 1500.0])) * [400, 1500]
        np.testing.assert_allclose(table[laser_id], expected)


def test_range_uncertainty_is_missing_outside_the_image(calibration: wb.Calibration) -> None:
    assert calibration.range_uncertainty([20.0])["sd_mm"].isna().any()


def test_refused_calibration_is_saved_only_with_a_reason(tmp_path: Path) -> None:
    rows = pd.read_csv(ROWS)
    rows.loc[rows["standoff_mm"] == 600, "standoff_mm"] = 6000.0
    refused = wb.fit(rows, RIG)
    assert refused.verdict == "refused"
    assert refused.reasons
    with pytest.raises(wb.LimitFailedError):
        refused.save(tmp_path / "c.yaml")
    with pytest.raises(wb.BadInputError):
        refused.accept(" ")
    with pytest.raises(wb.BadInputError):
        wb.Ranger(refused)
    refused.accept("for a test").save(tmp_path / "c.yaml")
    assert wb.load_calibration(tmp_path / "c.yaml").file.laser_ranger.fit.accepted_because == "for a test"


def test_comparison_finds_a_difference(calibration: wb.Calibration) -> None:
    session = wb.open_session(FOLDER)
    captures = session.captures_for_fit()
    captures["standoff_mm"] *= 1.2
    other = wb.fit(captures, session.rig)
    found = wb.compare(calibration, other)
    assert not found.same
    assert found.p_value < 0.01
    assert found.differences["difference_mm"].abs().max() > 10


@pytest.mark.parametrize("captures", ["no/such/file.csv", pd.DataFrame({"laser_id": ["1"]})])
def test_wrong_captures_are_refused(captures: str | pd.DataFrame) -> None:
    with pytest.raises(wb.BadInputError):
        wb.fit(captures, RIG)


def test_captures_of_other_lasers_are_refused() -> None:
    rows = pd.read_csv(ROWS).assign(laser_id="another")
    with pytest.raises(wb.BadInputError):
        wb.fit(rows, RIG)
