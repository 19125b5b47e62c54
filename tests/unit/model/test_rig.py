"""The lens of a rig file: its model, and the coefficients that belong to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.nested import fix_parameters
from workbench.model.rig import Rig, load_rig

RIG = """\
format: 1
rig: r
camera:
  width_px: 640
  height_px: 480
  f_px: {value: 305.0, sd: 25.0}
  cx_px: {value: 319.5, sd: 40.0}
  cy_px: {value: 239.5, sd: 40.0}
COEFFICIENTS
lasers:
  - {id: 1, axis: u, x_mm: {value: 30.0, sd: 0.2}, y_mm: {value: 0.0, sd: 0.2}}
"""
PRIOR = "{value: 0.01, sd: 0.1}"


def rig_with(tmp_path: Path, *lines: str) -> Rig:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.replace("COEFFICIENTS", "\n".join(f"  {line}" for line in lines)))
    return load_rig(path)


def refusal(tmp_path: Path, *lines: str) -> list[str]:
    """What is wrong, by the number of its line."""
    with pytest.raises(BadInputError) as caught:
        rig_with(tmp_path, *lines)
    return str(caught.value).replace(str(tmp_path / "rig.yaml"), "").splitlines()


def test_a_rig_file_without_a_lens_has_a_pinhole_with_brown_conrady_distortion(tmp_path: Path) -> None:
    camera = rig_with(tmp_path, f"k3: {PRIOR}", f"p1: {PRIOR}").camera
    assert camera.lens == "plumb_bob"
    assert list(camera.lens_priors) == ["f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"]
    assert (camera.lens_priors["p1"].sd, camera.lens_priors["k1"].sd) == (0.1, 0.0)


def test_a_fisheye_has_four_coefficients(tmp_path: Path) -> None:
    # The order of the keys is the file's affair.
    camera = rig_with(tmp_path, f"k4: {PRIOR}", "lens: equidistant", f"k1: {PRIOR}").camera
    assert list(camera.lens_priors) == ["f_px", "cx_px", "cy_px", "k1", "k2", "k3", "k4"]
    assert (camera.lens_priors["k4"].value, camera.lens_priors["k3"].sd) == (0.01, 0.0)


@pytest.mark.parametrize(
    ("lens", "key", "known"),
    [
        ("equidistant", "p1", "k1, k2, k3, k4"),
        ("equidistant", "p2", "k1, k2, k3, k4"),
        ("plumb_bob", "k4", "k1, k2, p1, p2, k3"),
    ],
)
def test_a_coefficient_of_the_other_model_is_refused_with_its_line(
    tmp_path: Path, lens: str, key: str, known: str
) -> None:
    (line,) = refusal(tmp_path, f"lens: {lens}", f"k1: {PRIOR}", f"{key}: {PRIOR}")
    assert line.startswith(f":11: camera.{key}: ")
    assert known in line
    assert f"got {key}" in line


def test_an_unknown_lens_is_one_mistake(tmp_path: Path) -> None:
    (line,) = refusal(tmp_path, "lens: fisheye", f"k4: {PRIOR}")
    assert line.startswith(":9: camera.lens: ")
    assert "plumb_bob" in line
    assert "equidistant" in line


def test_a_parameter_that_the_lens_has_not_cannot_be_held_constant(tmp_path: Path) -> None:
    rig = rig_with(tmp_path, "lens: equidistant", f"k4: {PRIOR}")
    assert fix_parameters(rig, ["k4"]).camera.k4.sd == 0.0
    with pytest.raises(BadInputError):
        fix_parameters(rig, ["p1"])
