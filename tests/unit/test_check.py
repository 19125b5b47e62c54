"""What `workbench check` says of files that are wrong: each mistake once, where it stands, in plain words."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.procedure import load_procedure
from workbench.model.rig import load_rig
from workbench.procedure.check import check_file

ROOT = Path(__file__).parents[2]
RIG = (ROOT / "rigs/thesis-emulated.yaml").read_text()
PROCEDURE = """\
format: 1
procedure: p
title: P
steps:
  - step: capture_grid
    standoffs_mm: [300, 600]
    repeats: 2
"""


def wrong(tmp_path: Path, text: str, name: str = "f.yaml") -> list[str]:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(BadInputError) as caught:
        check_file(path)
    return str(caught.value).replace(f"{tmp_path}/", "").splitlines()


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("repeats: 2", "repeats: two", "f.yaml:7: steps[0].repeats: expected a whole number, got 'two'"),
        ("    repeats: 2\n", "", "f.yaml:5: steps[0].repeats: is missing"),
        ("repeats: 2", "repeats: 2\n    colour: red", "f.yaml:8: steps[0].colour: no such key"),
        ("[300, 600]", "[]", "f.yaml:6: steps[0].standoffs_mm: expected at least 1, got 0"),
        ("[300, 600]", "[300, far]", "f.yaml:6: steps[0].standoffs_mm[1]: expected a number, got 'far'"),
        ("[300, 600]", "300", "f.yaml:6: steps[0].standoffs_mm: expected a list, got 300"),
    ],
)
def test_one_mistake_is_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert wrong(tmp_path, changed(PROCEDURE, old, new)) == [says]


def test_a_step_that_is_none_is_told_with_those_there_are(tmp_path: Path) -> None:
    (line,) = wrong(tmp_path, changed(PROCEDURE, "capture_grid", "capture_grd"))
    assert line.startswith("f.yaml:5: steps[0]: 'step': expected one of 'message', ")
    assert line.endswith(", got 'capture_grd'")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "f_px: {value: 533.3, sd: 26.7} ",
            "f_px: 533.3 ",
            ["f.yaml:12: camera.f_px: expected {value: ..., sd: ...}, got 533.3"],
        ),
        ("axis: u", "axis: w", ["f.yaml:20: lasers[0].axis: expected 'u' or 'v', got 'w'"]),
        ("id: L2", "id: L1", ["f.yaml:18: lasers: ids must differ, got L1, L1, L3, L4"]),
        (
            "seed: 2001",
            "seed: 2001\n  beam: {power_mw: 1 W, colour: red}\n  camera: {gain: 0.2}",
            [
                "f.yaml:58: emulator.beam.power_mw: expected a number, got '1 W'",
                "f.yaml:58: emulator.beam.colour: no such key",
                "f.yaml:59: emulator.camera.gain: expected at least 1.0, got 0.2",
            ],
        ),
        (
            "seed: 2001",
            "seed: 2001\n  truth: {lasers: {L9: {x_mm: 3}}}",
            [
                "f.yaml:58: emulator.truth: lasers.L9: expected a laser of the rig (L1, L2, L3, L4),"
                " got {'lasers': {'L9': {'x_mm': 3}}}"
            ],
        ),
        ("seed: 2001", "answers: true", ["f.yaml:56: emulator.seed: is missing"]),
        ("emulator:\n  seed: 2001", "", ["f.yaml:1: emulator.seed: is missing"]),
    ],
)
def test_a_rig_with_its_virtual_bench(tmp_path: Path, old: str, new: str, says: list[str]) -> None:
    assert wrong(tmp_path, changed(RIG, old, new)) == says


CALIBRATION = "%YAML 1.2\n---\nimage_width: 640\ncamera_name: c\nlaser_ranger:\n  format: 1\n"
CSV = "laser_id,standoff_mm,repeat,u_px,v_px\nL1,200,0,1,2\n"


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"expected a YAML file, got a folder; give the files in it"):
        check_file(tmp_path)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (CALIBRATION, "this is a calibration"),
        (CSV, "this is no mapping of keys to values"),
        ("a: 1\nb: 2\n", "this is a mapping of other keys"),
    ],
)
def test_a_file_of_another_kind_is_one_line_everywhere(tmp_path: Path, text: str, what: str) -> None:
    (line,) = wrong(tmp_path, text)
    assert line == f"f.yaml:1: expected a procedure or a rig, with one key of these names; {what}"
    for load, kind in ((load_procedure, "procedure"), (load_rig, "rig")):
        with pytest.raises(BadInputError) as caught:
            load(tmp_path / "f.yaml")
        assert str(caught.value).endswith(f"f.yaml:1: expected a {kind}, with the key {kind}; {what}")


def test_a_rig_given_as_a_procedure(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"expected a procedure, with the key procedure; this is a rig$"):
        load_procedure(ROOT / "rigs/thesis-emulated.yaml")
