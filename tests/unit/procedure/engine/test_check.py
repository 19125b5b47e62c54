"""What `workbench check` says of files that are wrong: each mistake once, where it stands, in plain words."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.procedure_file import load_procedure

ROOT = Path(__file__).parents[4]
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
        (
            "repeats: 2",
            "repeats: two",
            "f.yaml:7: steps[0].repeats: expected a whole number, such as 10, got 'two'",
        ),
        ("    repeats: 2\n", "", "f.yaml:5: steps[0].repeats: is missing"),
        (
            "repeats: 2",
            "repeats: 2\n    colour: red",
            "f.yaml:8: steps[0].colour: no such key; expected one of step, standoffs_mm, repeats, limits",
        ),
        ("[300, 600]", "[]", "f.yaml:6: steps[0].standoffs_mm: expected a list of at least 1, got 0"),
        (
            "[300, 600]",
            "[300, far]",
            "f.yaml:6: steps[0].standoffs_mm[1]: expected a number, such as 12.5, got 'far'",
        ),
        ("[300, 600]", "300", "f.yaml:6: steps[0].standoffs_mm: expected a list, such as [300], got 300"),
    ],
)
def test_one_mistake_is_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert wrong(tmp_path, changed(PROCEDURE, old, new)) == [says]


def test_a_step_that_is_none_is_told_with_those_there_are(tmp_path: Path) -> None:
    (line,) = wrong(tmp_path, changed(PROCEDURE, "capture_grid", "capture_grd"))
    assert line.startswith("f.yaml:5: steps[0].step: expected one of capture_grid, capture_board, ")
    assert line.endswith(", got 'capture_grd'")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "f_px: {value: 533.3, sd: 26.7} ",
            "f_px: 533.3 ",
            [
                "f.yaml:12: camera.f_px: expected a value and its standard deviation,"
                " {value: 533.3, sd: ...}, got 533.3"
            ],
        ),
        ("axis: u", "axis: w", ["f.yaml:20: lasers[0].axis: expected 'u' or 'v', got 'w'"]),
        ("id: L2", "id: L1", ["f.yaml:18: lasers: ids must differ, got L1, L1, L3, L4"]),
        (
            "seed: 2001",
            "seed: 2001\n  beam: {power_mw: 1 W, colour: red}\n  camera: {gain: 0.2}",
            [
                "f.yaml:58: emulator.beam.power_mw: expected a number, such as 1, got '1 W'",
                "f.yaml:58: emulator.beam.colour: no such key; expected one of power_mw, exit_diameter_mm,"
                " divergence_mrad, wavelength_nm, speckle_contrast",
                "f.yaml:59: emulator.camera.gain: expected at least 1, got 0.2",
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


def test_steps_are_held_against_each_other_whatever_else_is_wrong(tmp_path: Path) -> None:
    """A fit before any capture, an export before its fit, a limit without one, beside other mistakes."""
    text = """\
format: 1
procedure: p q
steps:
  - {step: fit}
  - {step: export, file: best.yml}
  - {step: check_limits, limits: {rms: {in: [0, 1]}}}
  - step: capture_grid
    standoffs_mm: [300, far]
    repeats: 2
  - {step: fit}
title: P
title: Q
"""
    told = wrong(tmp_path, text)
    assert [line.split(": ")[0].split(":")[1] for line in told] == ["2", "4", "5", "6", "8", "12"]
    assert told[1] == "f.yaml:4: steps[0]: fit needs what gives captures before it, which comes after it"
    assert "procedure: expected letters (A to z), digits, _ and - alone" in told[0]
    assert "begins with calibration" in told[2]
    assert "no such key; expected one of rms_px" in told[3]
    assert told[5].startswith("f.yaml:12: title: stands here again, after line 11")


@pytest.mark.parametrize("kind", ["capture_grd", "3", "[capture_grid]"])
def test_nothing_follows_from_a_step_that_cannot_be_read(tmp_path: Path, kind: str) -> None:
    """It may be the one that gives what the others need."""
    text = changed(PROCEDURE, "step: capture_grid", f"step: {kind}") + "  - {step: fit}\n  - {step: export}\n"
    told = wrong(tmp_path, text)
    assert len(told) == 1
    assert told[0].startswith("f.yaml:5: steps[0]")


def test_what_a_malformed_step_would_give_is_given(tmp_path: Path) -> None:
    told = wrong(tmp_path, changed(PROCEDURE, "repeats: 2", "repeats: 0") + "  - {step: fit}\n")
    assert told == ["f.yaml:7: steps[0].repeats: expected at least 1, got 0"]


def test_notes_stand_beside_the_mistakes(tmp_path: Path) -> None:
    """A fit without any capture may be meant for another procedure's, or may be the mistake."""
    told = wrong(
        tmp_path, changed(PROCEDURE, "repeats: 2", "repeats: 0").replace("capture_grid", "accuracy_trial")
    )
    assert [line.split(": ")[1] for line in told] == [
        "steps[0].readings",
        "note",
        "steps[0].repeats",
    ]
    assert told[1] == (
        "f.yaml:5: note: steps[0]: accuracy_trial needs a procedure before this one, in the same call, that"
        " gives calibration"
    )


def test_a_rig_is_looked_through_with_its_driver_and_bench(tmp_path: Path) -> None:
    """Mistakes of the rig hide neither a driver that is not there nor those of the virtual bench."""
    text = changed(changed(RIG, "axis: u", "axis: w"), "seed: 2001", "seed: none")
    assert [line.split(": ")[1] for line in wrong(tmp_path, text)] == ["lasers[0].axis", "emulator.seed"]
    text = changed(changed(RIG, "axis: u", "axis: w"), "driver: emulated", "driver: robot")
    assert [line.split(": ")[1] for line in wrong(tmp_path, text)] == ["driver", "lasers[0].axis"]


def test_a_driver_without_what_it_needs(tmp_path: Path) -> None:
    told = wrong(tmp_path, changed(RIG, "driver: emulated", "driver: opencv+serial"))
    assert told == [
        "f.yaml:1: devices.camera.source: is missing",
        "f.yaml:1: devices.lasers.port: is missing",
    ]
    block = "devices:\n  camera: {source: 0, gain: loud}\n  lasers: {port: /dev/ttyACM0}\n"
    (line,) = wrong(tmp_path, changed(RIG, "driver: emulated", "driver: opencv+serial") + block)
    assert "devices.camera.gain: expected a number, such as 12.5, got 'loud'" in line


HEAD = "format: 1\nprocedure: p\ntitle: P\nsteps:\n"


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        (
            "  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 0\n",
            ":7: steps[0].repeats: expected at least 1, got 0",
        ),
        ("  - step: dance\n", ":5: steps[0]"),
        (
            "  - step: fit\n  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 1\n",
            ":5: steps[0]: fit needs",
        ),
        (
            "  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 1\n"
            "  - step: fit\n  - step: check_limits\n"
            "    limits:\n      rms_px: {in: [0, 1], on_fail: retry}\n",
            "would give the same fit again",
        ),
    ],
)
def test_a_wrong_procedure_is_named_with_its_line(tmp_path: Path, steps: str, words: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(HEAD + steps)
    with pytest.raises(BadInputError) as caught:
        check_file(path)
    assert words in str(caught.value)


def test_what_every_file_of_ours_is_worth() -> None:
    for path in [*ROOT.glob("procedures/*.yaml"), *ROOT.glob("rigs/*.yaml")]:
        check_file(path)
    (note,) = check_file(ROOT / "procedures/accuracy-flat.yaml")
    assert "accuracy-flat.yaml:7: steps[0]: accuracy_trial needs a procedure before" in note


def test_a_rig_of_an_unknown_driver(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        (ROOT / "rigs/thesis-emulated.yaml").read_text().replace("driver: emulated", "driver: robot")
    )
    with pytest.raises(
        BadInputError, match=r"rig.yaml:6: driver: expected an installed bench driver .*got robot"
    ):
        check_file(rig)
    rig.write_text("lasers: []\n")
    with pytest.raises(BadInputError, match="expected a procedure or a rig"):
        check_file(rig)
