"""`camera: {from: FILE}` of a rig file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.camera_files import KALIBR, ROS
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig, load_rig
from workbench.model.yamlfile import parse_yaml_model, standalone_text

RIG = """\
format: 1
rig: r  # of the old bench
camera: CAMERA
lasers:
  - {id: 1, axis: u, x_mm: {value: 30.0, sd: 0.2}, y_mm: {value: 0.0, sd: 0.2}}
"""


def rig_file(folder: Path, camera: str, source: str = ROS) -> Path:
    (folder / "camera_info.yaml").write_text(source)
    path = folder / "rig.yaml"
    path.write_text(RIG.replace("CAMERA", camera))
    return path


def test_camera_comes_from_a_file_beside_the_rig(tmp_path: Path) -> None:
    camera = load_rig(rig_file(tmp_path, "{from: camera_info.yaml}")).camera
    assert (camera.width_px, camera.height_px, camera.lens) == (640, 480, "plumb_bob")
    assert camera.f_px.value == 540.5
    assert camera.k1.value == -0.27
    assert all(prior.sd > 0 for prior in camera.lens_priors.values())


def test_values_of_the_rig_file_take_precedence(tmp_path: Path) -> None:
    stated = "{from: camera_info.yaml, f_px: {sd: 0.4}, k1: {value: -0.2, sd: 0.0}, bits: 12}"
    camera = load_rig(rig_file(tmp_path, stated)).camera
    assert (camera.f_px.value, camera.f_px.sd) == (540.5, 0.4)
    assert (camera.k1.value, camera.k1.sd) == (-0.2, 0.0)
    assert camera.bits == 12


def test_a_binned_mode_scales_the_camera(tmp_path: Path) -> None:
    camera = load_rig(rig_file(tmp_path, "{from: camera_info.yaml, width_px: 320, height_px: 240}")).camera
    assert (camera.width_px, camera.f_px.value, camera.cx_px.value) == (320, 270.25, 158.75)


def test_one_camera_of_several(tmp_path: Path) -> None:
    camera = load_rig(rig_file(tmp_path, "{from: camera_info.yaml, name: cam1}", KALIBR)).camera
    assert (camera.lens, camera.k4.value) == ("equidistant", 0.04)


@pytest.mark.parametrize(
    ("camera", "part"),
    [
        ("{from: none.yaml}", "none.yaml"),
        ("{from: [1]}", "path of a camera file"),
        ("{from: camera_info.yaml, width_px: 640, height_px: 360}", "cropped"),
        ("{from: camera_info.yaml, lens: equidistant}", "camera.lens"),
        ("{from: camera_info.yaml, f_mm: 4}", "f_mm"),
        ("{from: camera_info.yaml, f_px: {sd: -1}}", "camera.f_px.sd"),
    ],
)
def test_bad_references_name_file_and_line(tmp_path: Path, camera: str, part: str) -> None:
    path = rig_file(tmp_path, camera)
    with pytest.raises(BadInputError, match=part) as caught:
        load_rig(path)
    assert str(caught.value).startswith(f"{path}:3: ")


def test_text_for_a_session_depends_on_no_other_file(tmp_path: Path) -> None:
    path = rig_file(tmp_path, "{from: camera_info.yaml, f_px: {sd: 0.4}}")
    rig, text = load_rig(path), standalone_text(path, Rig)
    (tmp_path / "camera_info.yaml").unlink()
    assert "# of the old bench" in text
    assert parse_yaml_model(text, tmp_path / "elsewhere/session.yaml", Rig) == rig


def test_text_without_a_reference_is_verbatim(tmp_path: Path) -> None:
    path = Path(__file__).parents[3] / "rigs/webcam-laser.yaml"
    assert standalone_text(path, Rig) == path.read_text()
