"""The YAML as other programs read it, and what the reader refuses."""

from __future__ import annotations

import json
import os
import runpy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml as pyyaml

from tests.support.rigs import FISHEYE_STANDOFFS_MM, PROVENANCE, World, fisheye_rig, opencv_pixels, thesis_rig
from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.selection.drift import with_drift
from workbench.calibration.verdict.assessment import assess
from workbench.calibration.verdict.export import calibrate, render, write_calibration
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def fitted() -> CalibrationFit:
    return fit(thesis_rig(), World(thesis_rig(), 1).observations())


@pytest.fixture(scope="module")
def calibration(fitted: CalibrationFit) -> Calibration:
    return calibrate(fitted, Acceptance(), PROVENANCE)[0]


@pytest.fixture
def path(calibration: Calibration, tmp_path: Path) -> Path:
    path = tmp_path / "calibration.yaml"
    write_calibration(path, calibration)
    return path


def test_what_is_written_is_read_to_the_last_digit(calibration: Calibration, path: Path) -> None:
    assert load_calibration(path) == calibration


def test_the_header_and_ros_s_keys(path: Path) -> None:
    lines = path.read_text().splitlines()
    assert lines[0] == "%YAML 1.2"
    keys = [line.split(":")[0] for line in lines if line[:1].isalpha()]
    assert keys == [
        "image_width",
        "image_height",
        "camera_name",
        "camera_matrix",
        "distortion_model",
        "distortion_coefficients",
        "rectification_matrix",
        "projection_matrix",
        "laser_ranger",
    ]


def numbers(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return [n for item in value.values() for n in numbers(item)]
    if isinstance(value, list | tuple):
        return [n for item in value for n in numbers(item)]
    return [value]


def test_pyyaml_reads_the_same(calibration: Calibration, path: Path) -> None:
    """PyYAML takes 1e-3 for a string and 2026-11-22 for a date: every type must come back."""
    read = pyyaml.safe_load(path.read_text())
    assert numbers(read) == numbers(calibration.model_dump())
    assert [type(n) for n in numbers(read)] == [type(n) for n in numbers(calibration.model_dump())]


def test_opencv_reads_the_same(calibration: Calibration, path: Path) -> None:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    ours = storage.getNode("laser_ranger")

    def reals(node: cv2.FileNode) -> list[float]:
        return [node.at(i).real() for i in range(node.size())]

    parameters = calibration.laser_ranger.parameters
    assert storage.getNode("image_width").real() == 640
    assert reals(storage.getNode("camera_matrix").getNode("data")) == list(calibration.camera_matrix.data)
    assert reals(ours.getNode("parameters").getNode("values")) == list(parameters.values)
    covariance = ours.getNode("parameters").getNode("covariance")
    assert reals(covariance.getNode("data")) == list(parameters.covariance.data)
    first = ours.getNode("lasers").at(0)
    assert first.getNode("id").string() == "L1"
    assert reals(first.getNode("origin_mm")) == list(calibration.laser_ranger.lasers[0].origin_mm)
    assert ours.getNode("provenance").getNode("created").string() == PROVENANCE.created
    storage.release()


def test_ros_s_rules_for_camera_info(path: Path) -> None:
    """As camera_calibration_parsers demands: these keys, matrices with rows, cols, data of that size."""
    read = pyyaml.safe_load(path.read_text())
    for key, rows, cols in (
        ("camera_matrix", 3, 3),
        ("distortion_coefficients", 1, 5),
        ("rectification_matrix", 3, 3),
        ("projection_matrix", 3, 4),
    ):
        assert (read[key]["rows"], read[key]["cols"]) == (rows, cols)
        assert np.shape(read[key]["data"]) == (rows * cols,)
    assert read["distortion_model"] == "plumb_bob"
    projection = np.reshape(read["projection_matrix"]["data"], (3, 4))
    np.testing.assert_array_equal(projection[:, :3], np.reshape(read["camera_matrix"]["data"], (3, 3)))


@pytest.fixture(scope="module")
def of_fisheye() -> Calibration:
    rig = fisheye_rig()
    fisheye = fit(rig, World(rig, 1).observations(FISHEYE_STANDOFFS_MM))
    return calibrate(fisheye, Acceptance(), PROVENANCE)[0]


def test_a_fisheye_has_ros_s_name_and_four_coefficients(of_fisheye: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "fisheye.yaml"
    write_calibration(path, of_fisheye)
    assert load_calibration(path) == of_fisheye
    read = pyyaml.safe_load(path.read_text())
    assert read["distortion_model"] == "equidistant"
    assert (read["distortion_coefficients"]["rows"], read["distortion_coefficients"]["cols"]) == (1, 4)
    names = read["laser_ranger"]["parameters"]["names"]
    assert names[:9] == ["f_px", "cx_px", "cy_px", "k1", "k2", "k3", "k4", "offset_mm", "ruler_scale"]
    wrong = path.read_text().replace("equidistant", "plumb_bob")
    (tmp_path / "wrong.yaml").write_text(wrong)
    with pytest.raises(BadInputError):
        load_calibration(tmp_path / "wrong.yaml")


@pytest.mark.parametrize("lens", ["plumb_bob", "equidistant"])
def test_opencv_s_file_and_lens_show_spots_where_ours_do(
    lens: str, calibration: Calibration, of_fisheye: Calibration, tmp_path: Path
) -> None:
    """OpenCV alone: its reader, and its lens, on the beams of the file."""
    ours = of_fisheye if lens == "equidistant" else calibration
    write_calibration(tmp_path / "c.yaml", ours)
    storage = cv2.FileStorage(str(tmp_path / "c.yaml"), cv2.FILE_STORAGE_READ)
    camera, coefficients = (
        storage.getNode(key).mat() for key in ("camera_matrix", "distortion_coefficients")
    )
    name = storage.getNode("distortion_model").string()
    storage.release()
    assert name == lens
    intrinsic = [camera[0, 0], camera[0, 2], camera[1, 2], *coefficients.ravel()]
    range_mm = np.array([60.0, 200.0, 1500.0])
    for laser in ours.laser_ranger.lasers:
        depth = (range_mm + ours.laser_ranger.reference_plane.offset_mm)[:, None]
        points = np.array(laser.origin_mm) + depth * np.array(laser.direction)
        expected = CalibratedSensor(ours).spot_px(laser.id, range_mm)
        np.testing.assert_allclose(
            opencv_pixels(ours.distortion_model, intrinsic, points), expected, rtol=1e-9
        )


@pytest.mark.parametrize("lens", ["plumb_bob", "equidistant"])
def test_the_reader_in_the_docs_ranges_alike(
    lens: str, calibration: Calibration, of_fisheye: Calibration, tmp_path: Path
) -> None:
    ours = of_fisheye if lens == "equidistant" else calibration
    write_calibration(tmp_path / "c.yaml", ours)
    reader = runpy.run_path(str(ROOT / "docs/examples/read_calibration.py"))["Sensor"](tmp_path / "c.yaml")
    sensor = CalibratedSensor(ours)
    for laser_id in sensor.ids:
        spots = sensor.spot_px(laser_id, np.array([60.0, 150.0, 700.0, 1800.0]))
        for spot in spots + np.array([0.02, -0.03]):
            expected = sensor.ranges([laser_id], spot[None], np.array([[0.04, 0.06]]))
            range_mm, to_range, spot_variance = reader.range(laser_id, *spot, 0.04, 0.06)
            assert range_mm == pytest.approx(expected.range_mm[0], rel=1e-6)
            assert reader.sigma(to_range, spot_variance) == pytest.approx(expected.sigma_mm[0], rel=1e-6)


def edited(path: Path, change: Callable[[dict[str, Any]], None]) -> str:
    """The reader's complaint about the file after a change."""
    data = pyyaml.safe_load(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    with pytest.raises(BadInputError) as caught:
        load_calibration(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_a_number_that_says_two_things(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["camera_matrix"]["data"][0] = data["camera_matrix"]["data"][4] = 600.0

    assert "f_px is 600.0" in edited(path, change)


def test_a_covariance_with_a_negative_variance(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["laser_ranger"]["parameters"]["covariance"]["data"][0] = -1.5e-12

    assert "no negative variance, got -1.5e-12" in edited(path, change)


def test_a_covariance_that_is_none(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        matrix = data["laser_ranger"]["parameters"]["covariance"]
        cells, n = matrix["data"], matrix["cols"]
        cells[1] = cells[n] = 1.1 * (cells[0] * cells[n + 1]) ** 0.5  # more than fully correlated

    assert "no negative eigenvalue" in edited(path, change)


def test_a_covariance_that_is_not_symmetric(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["laser_ranger"]["parameters"]["covariance"]["data"][1] += 1.0

    assert "symmetric" in edited(path, change)


def test_a_matrix_with_a_number_missing(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["camera_matrix"]["data"].pop()

    assert "camera_matrix: expected 3 x 3 numbers, got 8" in edited(path, change)


def test_lists_of_different_lengths(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["laser_ranger"]["parameters"]["sd"].pop()

    assert "sd: expected one for each of 30 names, got 29" in edited(path, change)


def test_pixels_that_are_not_square(path: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        data["camera_matrix"]["data"][4] *= 1.01

    assert "square pixels" in edited(path, change)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_truncated_file(path: Path, part: float) -> None:
    text = path.read_text()
    path.write_text(text[: int(part * len(text))])
    with pytest.raises(BadInputError, match=str(path)):
        load_calibration(path)


def test_a_failed_write_leaves_the_old_file(
    calibration: Calibration, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = path.read_bytes()

    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("workbench.session.files.os.fsync", no_space)
    with pytest.raises(BadInputError, match="No space left"):
        write_calibration(path, calibration)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_folder_that_is_not_there(calibration: Calibration, tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="cannot be written"):
        write_calibration(tmp_path / "no" / "cal.yaml", calibration)


def test_rendering_is_reproducible(calibration: Calibration) -> None:
    assert render(calibration) == render(calibration.model_copy())


def test_a_good_fit_is_accepted(fitted: CalibrationFit, calibration: Calibration) -> None:
    found = assess(fitted, Acceptance(), 0.01, leave_each_out(fitted))
    assert (found.verdict, found.reasons) == ("accepted", ())
    assert calibration.laser_ranger.validity.standoff_mm == (125.0, 4500.0)
    assert 0.001 < calibration.laser_ranger.validity.max_relative_range_sd < 0.03


def test_the_warnings_say_what_the_data_cannot_tell(fitted: CalibrationFit) -> None:
    assessment = calibrate(fitted, Acceptance(), PROVENANCE)[1]
    (of_f,) = [one for one in assessment.directions if next(iter(one.change)) == "f_px"]
    assert of_f.line in assessment.warnings
    assert any(text.startswith("ruler_scale ") for text in assessment.warnings)


def test_a_link_is_followed_and_a_special_file_is_left_alone(calibration: Calibration, path: Path) -> None:
    link, pipe = path.with_name("link.yaml"), path.with_name("pipe")
    link.symlink_to(path)
    path.write_text("old")
    write_calibration(link, calibration)
    assert link.is_symlink()
    assert load_calibration(path) == calibration
    os.mkfifo(pipe)
    for other in (pipe, path.parent):
        with pytest.raises(BadInputError, match="expected the name of a file"):
            write_calibration(other, calibration)
    assert pipe.is_fifo()


def test_a_fit_that_puts_every_spot_outside_the_picture_is_refused(fitted: CalibrationFit) -> None:
    values = fitted.values.copy()
    values[1] += 5000.0
    with pytest.raises(LimitFailedError):
        calibrate(replace(fitted, values=values), Acceptance(), PROVENANCE)


def test_few_placements_state_what_their_cross_validation_supports() -> None:
    few = fit(thesis_rig(), World(thesis_rig(), 1).observations((125.0, 600.0, 2200.0)))
    calibration, assessment = calibrate(few, Acceptance(), PROVENANCE)
    predicted = max(one.sd_mm / one.standoff_mm for one in assessment.cross_validation)
    assert calibration.laser_ranger.validity.max_relative_range_sd == predicted > 0.03


def test_half_of_a_drift_is_added_to_the_image_centre() -> None:
    rig = with_drift(thesis_rig())
    drifting = [
        replace(s, u_px=s.u_px + 0.4 * n / 219) for n, s in enumerate(World(thesis_rig(), 1).observations())
    ]
    found = fit(rig, drifting)
    parameters = calibrate(found, Acceptance(), PROVENANCE)[0].laser_ranger.parameters
    index = parameters.names.index("cx_px")
    assert parameters.sd[index] == pytest.approx(np.hypot(found.sd[index], found.drift_px[0] / 2))
    assert parameters.covariance_array[index, index] == pytest.approx(parameters.sd[index] ** 2)


def test_the_cross_validation_of_every_placement_is_kept(
    fitted: CalibrationFit, calibration: Calibration
) -> None:
    kept = calibration.laser_ranger.fit.cross_validation
    expected = leave_each_out(fitted)
    assert [(one.standoff_mm, one.error_mm, one.sd_mm) for one in kept] == [
        (one.standoff_mm, one.error_mm, one.sd_mm) for one in expected
    ]
