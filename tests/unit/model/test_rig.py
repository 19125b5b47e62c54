"""The rig file: its lens and the coefficients that belong to it, priors, lasers, bench."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.rigs import thesis_rig
from workbench.model.errors import BadInputError
from workbench.model.nested import fix_parameters
from workbench.model.prior import Prior
from workbench.model.rig import BenchSpec, CameraSpec, LaserSpec, Rig, load_rig

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


LASER = {"id": "L1", "axis": "u", "x_mm": {"value": 30.0, "sd": 0.2}, "y_mm": {"value": 0.0, "sd": 0.2}}


@pytest.mark.parametrize(
    ("value", "sd", "good"),
    [
        (0.0, 0.0, True),
        (-1e6, 1e6, True),
        (0.0, 1e-9, True),
        (0.0, 1e-10, False),
        (0.0, -1.0, False),
        (1.1e6, 0.0, False),
        (float("nan"), 0.0, False),
    ],
)
def test_a_prior_is_known_exactly_or_to_a_deviation_that_can_be_computed_with(
    value: float, sd: float, good: bool
) -> None:
    if good:
        assert Prior.model_validate({"value": value, "sd": sd}) == Prior(value=value, sd=sd)
    else:
        with pytest.raises(ValidationError):
            Prior.model_validate({"value": value, "sd": sd})


@pytest.mark.parametrize(("f_px", "good"), [(-305.0, False), (0.99, False), (1.0, True), (1e4, True)])
def test_a_focal_length_is_one_pixel_or_more(f_px: float, good: bool) -> None:
    data = thesis_rig().camera.model_dump(exclude_unset=True) | {"f_px": {"value": f_px, "sd": 0.5}}
    if good:
        assert CameraSpec.model_validate(data).f_px.value == f_px
    else:
        with pytest.raises(ValidationError) as caught:
            CameraSpec.model_validate(data)
        assert [error["loc"] for error in caught.value.errors()] == [("f_px",)]


@pytest.mark.parametrize(
    "change",
    [
        {"id": "all"},
        {"id": "board"},
        {"id": "-L"},
        {"id": "a/b"},
        {"axis": "x"},
        {"x_mm": {"value": 0.0, "sd": 0.2}},
        {"axis": "v"},
    ],
)
def test_a_laser_without_a_name_of_its_own_or_a_baseline_is_refused(change: dict[str, Any]) -> None:
    assert LaserSpec.model_validate(LASER | {"id": 1}).id == "1"
    with pytest.raises(ValidationError):
        LaserSpec.model_validate(LASER | change)


def test_a_laser_may_stand_anywhere_but_at_the_pinhole() -> None:
    anywhere = {key: value for key, value in LASER.items() if key != "axis"}
    assert LaserSpec.model_validate(anywhere | {"y_mm": {"value": 25.0, "sd": 0.2}}).axis is None
    with pytest.raises(ValidationError, match="baseline"):
        LaserSpec.model_validate(anywhere | {"x_mm": {"value": 0.0, "sd": 0.2}})


@pytest.mark.parametrize(
    ("change", "good"),
    [({}, False), ({"tx": {"value": 0.01, "sd": 0.0}}, True), ({"y_mm": {"value": 1.0, "sd": 0.2}}, True)],
)
def test_two_lasers_do_not_have_the_same_beam(change: dict[str, Any], good: bool) -> None:
    data = thesis_rig().model_dump(exclude_unset=True) | {"lasers": [LASER, LASER | {"id": "L2"} | change]}
    if good:
        assert Rig.model_validate(data).laser_ids == ("L1", "L2")
        return
    with pytest.raises(ValidationError, match="L1 and L2 with the same beam"):
        Rig.model_validate(data)


def test_beams_of_one_emitter_share_an_output_of_the_controller() -> None:
    beams = [
        LASER | {"id": i, "emitter": e, "ty": {"value": 0.01 * n, "sd": 0.0}}
        for n, (i, e) in enumerate([("A", "g"), ("B", None), ("C", "g"), ("g", None)])
    ]
    rig = Rig.model_validate(thesis_rig().model_dump(exclude_unset=True) | {"lasers": beams})
    assert [[laser.id for laser in group] for group in rig.emitters] == [["A", "C"], ["B"], ["g"]]
    assert rig.laser_lines == (0, 1, 0, 2)


@pytest.mark.parametrize("reach_mm", [(500.0, 500.0), (500.0, 100.0), (0.0, 100.0), (100.0, 1.1e6)])
def test_the_reach_of_a_bench_is_from_near_to_far(reach_mm: tuple[float, float]) -> None:
    with pytest.raises(ValidationError) as caught:
        BenchSpec.model_validate({"reach_mm": reach_mm})
    assert caught.value.errors()[0]["loc"][0] == "reach_mm"


def test_a_common_tilt_is_a_slope_with_the_deviation_of_its_angle() -> None:
    """By differences of the tangent; half a degree about each axis where nothing is stated."""
    for slope in (BenchSpec().target_slope_x, BenchSpec().target_slope_y):
        assert slope.value == 0.0
        assert slope.sd == pytest.approx(np.radians(0.5))
    bench = BenchSpec(target_yaw_deg=-20.0, target_pitch_deg=35.0, target_tilt_sd_deg=0.2)
    for slope, angle in ((bench.target_slope_x, -20.0), (bench.target_slope_y, 35.0)):
        below, at, above = np.tan(np.radians([angle - 1e-4, angle, angle + 1e-4]))
        assert slope.value == pytest.approx(at)
        assert slope.sd == pytest.approx(0.2 * (above - below) / 2e-4, rel=1e-6)


@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        ("target_yaw_deg", (-60.0, 60.0), (-60.1, 60.1, float("nan"))),
        ("target_pitch_deg", (-60.0, 60.0), (-60.1, 60.1, float("inf"))),
        ("target_tilt_sd_deg", (0.0, 45.0), (-0.1, 45.1, float("nan"))),
        ("drift_u_px", ({"value": -0.3, "sd": 0.0}, {"value": 0.0, "sd": 0.3}), (0.3, {"value": 0.3})),
        ("drift_v_px", ({"value": -0.3, "sd": 0.0}, {"value": 0.0, "sd": 0.3}), (0.3, {"sd": -0.3})),
    ],
)
def test_common_tilt_and_drift_have_bounds(key: str, good: Sequence[Any], bad: Sequence[Any]) -> None:
    for value in good:
        BenchSpec.model_validate({key: value})
    for value in bad:
        with pytest.raises(ValidationError) as caught:
            BenchSpec.model_validate({key: value})
        assert caught.value.errors()[0]["loc"][0] == key


def test_an_image_does_not_drift_unless_stated() -> None:
    assert BenchSpec().drift_u_px == BenchSpec().drift_v_px == Prior(value=0.0, sd=0.0)


def test_lasers_have_ids_that_differ() -> None:
    data = thesis_rig().model_dump(exclude_unset=True)
    assert Rig.model_validate(data).laser_ids == ("L1", "L2", "L3", "L4")
    with pytest.raises(ValidationError) as caught:
        Rig.model_validate(data | {"lasers": [data["lasers"][0]] * 2})
    assert [error["loc"] for error in caught.value.errors()] == [("lasers",)]


def test_only_a_fit_of_the_camera_accepts_a_rig_without_lasers(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.partition("lasers:")[0].replace("COEFFICIENTS", "").rstrip() + "\n")
    assert load_rig(path, camera_alone=True).lasers == ()
    with pytest.raises(BadInputError, match="lasers"):
        load_rig(path)


def test_a_rig_has_one_of_the_known_boards(tmp_path: Path) -> None:
    def boarded(*lines: str) -> Rig:
        path = tmp_path / "rig.yaml"
        path.write_text(RIG.replace("COEFFICIENTS", "") + "\n".join(lines) + "\n")
        return load_rig(path)

    assert boarded().banded_board.columns == 13
    assert boarded("board: {columns: 11}").banded_board.columns == 11
    chessboard = boarded("board: {kind: chessboard, corners: [9, 6], square_mm: 25}")
    assert len(chessboard.board.corners_mm) == 54
    with pytest.raises(BadInputError, match="chessboard"):
        _ = chessboard.banded_board
    for wrong in ("{kind: checkers}", "{kind: chessboard, corners: [3, 3], square_mm: 1}", "{rows: 1}"):
        with pytest.raises(BadInputError, match="board"):
            boarded(f"board: {wrong}")


@pytest.mark.parametrize(("laser_class", "good"), [(2, True), ("3R", True), ("5", False), (True, False)])
def test_a_laser_class_is_one_of_the_standard(laser_class: object, good: bool) -> None:
    data = thesis_rig().model_dump(exclude_unset=True) | {"laser_class": laser_class}
    if good:
        assert Rig.model_validate(data).laser_class == str(laser_class)
    else:
        with pytest.raises(ValidationError):
            Rig.model_validate(data)


@pytest.mark.parametrize("lens", ["plumb_bob", "equidistant"])
@pytest.mark.parametrize("unset", [True, False])
def test_a_rig_is_read_back_from_its_own_values(tmp_path: Path, lens: str, unset: bool) -> None:
    rig = rig_with(tmp_path, f"lens: {lens}", f"k2: {PRIOR}")
    assert rig.camera.lens == lens
    assert Rig.model_validate(rig.model_dump(exclude_unset=unset)) == rig
    assert Rig.model_validate_json(rig.model_dump_json(exclude_unset=unset)) == rig


def test_omitted_bench_values_are_those_of_the_documentation() -> None:
    bench = BenchSpec()
    assert bench.reach_mm == (100.0, 5000.0)
    assert (bench.placement_sd_mm, bench.tilt_sd_deg, bench.target_tilt_sd_deg) == (0.0, 0.0, 0.5)
    assert (bench.print_scale.value, bench.print_scale.sd, bench.board_flatness_sd_mm) == (0.0, 0.002, 0.1)
    assert bench.drift_u_px == bench.drift_v_px == Prior(value=0.0, sd=0.0)


@pytest.mark.parametrize("written", ["01", "0x10", "1_0", "007"])
def test_digits_whose_spelling_yaml_loses_need_quotes_as_an_id(tmp_path: Path, written: str) -> None:
    text = RIG.replace("COEFFICIENTS", "")
    path = tmp_path / "rig.yaml"
    path.write_text(text.replace("id: 1", f"id: {written}"))
    with pytest.raises(BadInputError, match="quotes"):
        load_rig(path)
    path.write_text(text.replace("id: 1", f"id: '{written}'"))
    assert load_rig(path).laser_ids[0] == written
    path.write_text(text)
    assert load_rig(path).laser_ids[0] == "1"


HEAD = """\
head:
  laser: LASER
  scale: {value: 0.0, sd: 0.001}
  reach_deg: REACH
"""


def with_head(tmp_path: Path, laser: str = '"1"', reach: str = "[-40, 30]") -> Rig:
    path = tmp_path / "rig.yaml"
    text = RIG.replace("COEFFICIENTS", "  k1: {value: 0.0, sd: 0.1}")
    path.write_text(text + HEAD.replace("LASER", laser).replace("REACH", reach))
    return load_rig(path)


def test_a_head_turns_one_of_the_lasers(tmp_path: Path) -> None:
    rig = with_head(tmp_path)
    assert rig.head_laser is rig.lasers[0]
    assert rig.scanning_head.axis_z_mm.sd == 0.0
    with pytest.raises(BadInputError, match=r"expected a laser of the rig \(1\), got 2"):
        with_head(tmp_path, '"2"')
    with pytest.raises(BadInputError, match=r"expected \[smallest, largest\] within 80 deg"):
        with_head(tmp_path, reach="[10, -10]")


def test_a_head_is_beside_the_camera(tmp_path: Path) -> None:
    vertical = RIG.replace("axis: u, x_mm", "axis: v, y_mm").replace(
        "y_mm: {value: 0.0, sd: 0.2}}", "x_mm: {value: 0.0, sd: 0.2}}"
    )
    path = tmp_path / "rig.yaml"
    head = HEAD.replace("LASER", '"1"').replace("REACH", "[-40, 30]")
    path.write_text(vertical.replace("COEFFICIENTS", "  k1: {value: 0.0, sd: 0.1}") + head)
    with pytest.raises(
        BadInputError, match="expected a laser beside the camera, got 1, which is above or below it"
    ):
        load_rig(path)


def test_a_rig_without_head_says_where_heads_are_described() -> None:
    with pytest.raises(BadInputError, match="scanning head, with the key head"):
        _ = thesis_rig().head_laser
