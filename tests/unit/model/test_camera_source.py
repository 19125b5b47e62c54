"""Camera files of other programs: what each format states, and what is refused by name."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.camera_files import KALIBR, MESSAGE, MRCAL, ROS
from workbench.model.camera_source import read_intrinsics
from workbench.model.errors import BadInputError

ROOT = Path(__file__).parents[3]


def write(folder: Path, text: str, name: str = "camera.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_ros_camera_info(tmp_path: Path) -> None:
    found = read_intrinsics(write(tmp_path, ROS))
    assert (found.size_px, found.f_px, found.centre_px) == ((640, 480), (540.0, 541.0), (318.0, 241.0))
    assert found.coefficients == {"k1": -0.27, "k2": 0.06, "p1": 0.001, "p2": -0.0005, "k3": 0.01}
    assert found.sd == {}


def test_region_of_a_ros_message_shifts_the_centre(tmp_path: Path) -> None:
    found = read_intrinsics(write(tmp_path, MESSAGE))
    assert (found.size_px, found.centre_px) == ((640, 480), (540.0, 400.0))
    assert found.coefficients["k3"] == 0.01


def test_opencv_yaml_of_its_own_example() -> None:
    found = read_intrinsics(ROOT / "data/opencv-chessboards/left_intrinsics.yml")
    assert found.size_px == (640, 480)
    assert found.f_px[0] == pytest.approx(535.91573, abs=1e-4)
    assert found.coefficients["k1"] == pytest.approx(-0.266373, abs=1e-6)


@pytest.mark.parametrize("extension", ["yml", "xml"])
def test_opencv_files_with_stated_deviations(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"camera.{extension}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("cameraMatrix", np.array([[800.0, 0, 320], [0, 800.0, 240], [0, 0, 1]]))
    storage.write("cameraMatrix_std_dev", np.array([[0.0], [1.5], [0.8], [0.9]]))
    storage.write("dist_coeffs", np.array([[-0.1, 0.02, 0.0, 0.0, 0.0]]))
    storage.write("dist_coeffs_std_dev", np.array([[0.003], [0.01], [0.0], [0.0], [0.0]]))
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.release()
    found = read_intrinsics(path)
    assert (found.size_px, found.f_px) == ((640, 480), (800.0, 800.0))
    assert found.sd == {"f_px": 1.5, "cx_px": 0.8, "cy_px": 0.9, "k1": 0.003, "k2": 0.01}


def test_kalibr_camchain_names_its_camera(tmp_path: Path) -> None:
    path = write(tmp_path, KALIBR)
    first, second = read_intrinsics(path, "cam0"), read_intrinsics(path, "cam1")
    assert (first.lens, first.coefficients["p2"], first.size_px) == ("plumb_bob", 1.8e-05, (752, 480))
    assert (second.lens, second.coefficients["k4"]) == ("equidistant", 0.04)
    for name in (None, "cam2"):
        with pytest.raises(BadInputError, match="cam0, cam1"):
            read_intrinsics(path, name)


def test_mrcal_camera_model(tmp_path: Path) -> None:
    found = read_intrinsics(write(tmp_path, MRCAL, "a.cameramodel"))
    assert (found.size_px, found.f_px[0], found.coefficients["k3"]) == ((4000, 2200), 1761.18, 0.02)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (ROS.replace("cols: 5", "cols: 8").replace("0.01]", "0.01, 0.2, 0.1, 0.0]"), "k4, k5"),
        (MRCAL.replace("0.02, 0.0,", "0.02, 0.3,"), "k4"),
        (MRCAL.replace("LENSMODEL_OPENCV8", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30"), "SPLINED"),
        (MRCAL.replace("LENSMODEL_OPENCV8", "LENSMODEL_CAHVOR"), "LENSMODEL_CAHVOR"),
        (ROS.replace("plumb_bob", "scaramuzza"), "scaramuzza"),
        (KALIBR.replace("camera_model: pinhole", "camera_model: omni"), "omni"),
        (KALIBR.replace("radtan", "fov"), "fov"),
    ],
)
def test_foreign_lens_models_are_refused_by_name(tmp_path: Path, text: str, name: str) -> None:
    with pytest.raises(BadInputError, match=name) as caught:
        read_intrinsics(write(tmp_path, text), "cam0" if "cam0" in text else None)
    assert "plumb_bob" in str(caught.value)  # the models that would do


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1",
        "a: [1, 2]",
        ROS.replace("540.0, 0.0", "540.0, 3.0"),
        ROS.replace("540.0", "-540.0"),
        ROS.replace("540.0", "fast"),
        ROS.replace("540.0, ", ""),
        ROS.replace("[-0.27", "[.nan"),
        KALIBR.replace("intrinsics: [458.6, ", "intrinsics: ["),
        "{'lensmodel': 'LENSMODEL_OPENCV5'",
        "{'lensmodel': 'LENSMODEL_OPENCV5'}",
        '<?xml version="1.0"?><opencv_storage><camera_matrix>',
        '<?xml version="1.0"?><opencv_storage><a>1</a></opencv_storage>',
        "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n",
    ],
)
def test_files_that_are_no_camera_are_refused_with_their_name(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInputError, match=r"camera\.yaml"):
        read_intrinsics(write(tmp_path, text))
