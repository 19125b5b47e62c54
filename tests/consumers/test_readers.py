"""The calibration file is read by the parsers that its users have: ROS, OpenCV in C++, yaml-cpp."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.consumers.calibrations import RIGS, calibration_with, missing
from workbench.calibration.verdict.export import render
from workbench.model.calibration import Calibration

HERE = Path(__file__).parent
SYSTEM_PYTHON = Path("/usr/bin/python3")
"""Interpreter for which Debian packages ROS's parser."""
READ_BY_ROS = """
import json, sys, camera_calibration_parsers
name, info = camera_calibration_parsers.readCalibration(sys.argv[1])
found = {"name": name, "width": info.width, "height": info.height, "model": info.distortion_model}
print(json.dumps(found | {"D": list(info.D), "K": list(info.K), "P": list(info.P)}))
"""


@pytest.fixture(params=RIGS)
def stored(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Calibration, Path]:
    """A calibration and its file."""
    calibration, path = calibration_with(request.param), tmp_path / "calibration.yaml"
    path.write_text(render(calibration))
    return calibration, path


def test_the_parser_of_ros_reads_the_lens(stored: tuple[Calibration, Path]) -> None:
    calibration, path = stored
    if not SYSTEM_PYTHON.exists():
        missing("Python of the system")
    ended = subprocess.run(
        [SYSTEM_PYTHON, "-c", READ_BY_ROS, path], capture_output=True, text=True, check=False
    )
    if "No module named 'camera_calibration_parsers'" in ended.stderr:
        missing("parser of ROS camera calibrations")

    found = json.loads(ended.stdout)

    assert found == {
        "name": calibration.camera_name,
        "width": calibration.image_width,
        "height": calibration.image_height,
        "model": calibration.distortion_model,
        "D": list(calibration.distortion_coefficients.data),
        "K": list(calibration.camera_matrix.data),
        "P": list(calibration.projection_matrix.data),
    }


@dataclass(frozen=True)
class Library:
    """A C++ library with a reader of ours."""

    source: str
    header: Path
    options: tuple[str, ...]


LIBRARIES = {
    "OpenCV": Library(
        "read_opencv.cpp",
        Path("/usr/include/opencv4/opencv2/core.hpp"),
        ("-I/usr/include/opencv4", "-lopencv_core"),
    ),
    "yaml-cpp": Library("read_yaml_cpp.cpp", Path("/usr/include/yaml-cpp/yaml.h"), ("-lyaml-cpp",)),
}


@pytest.fixture(scope="module", params=LIBRARIES)
def reader(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A compiled reader."""
    library = LIBRARIES[request.param]
    if shutil.which("g++") is None or not library.header.exists():
        missing(f"C++ compiler, or no {request.param}")
    program = tmp_path_factory.mktemp("reader") / "read"
    subprocess.run(["g++", "-std=c++17", "-o", program, HERE / library.source, *library.options], check=True)
    return program


def test_a_parser_in_cpp_reads_every_number(stored: tuple[Calibration, Path], reader: Path) -> None:
    calibration, path = stored
    ranger = calibration.laser_ranger
    numbers: list[float] = [calibration.image_width, calibration.image_height]
    numbers += [*calibration.camera_matrix.data, *calibration.distortion_coefficients.data]
    numbers += [ranger.reference_plane.offset_mm]
    numbers += [value for laser in ranger.lasers for value in (*laser.origin_mm, *laser.direction)]

    ended = subprocess.run([reader, path], capture_output=True, text=True, check=True)

    *found, trace = map(float, ended.stdout.split())
    assert found == numbers
    assert trace == pytest.approx(np.trace(ranger.parameters.covariance_array), rel=1e-12)
