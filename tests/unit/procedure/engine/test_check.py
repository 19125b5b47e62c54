"""`check_file`: each mistake once, with line and key, in the order of the file; notes apart from mistakes."""

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
HEAD = "format: 1\nprocedure: p\ntitle: P\nsteps:\n"
CALIBRATION = "%YAML 1.2\n---\nimage_width: 640\ncamera_name: c\nlaser_ranger:\n  format: 1\n"
CSV = "laser_id,standoff_mm,repeat,u_px,v_px\nL1,200,0,1,2\n"
Place = tuple[int, str]


def place(path: Path, text: str) -> Place:
    """Line and key of a mistake or note, after checking that it names the file."""
    file, _, rest = text.partition(f"{path.name}:")
    assert file == f"{path.parent}/"
    line, key, _ = rest.split(": ", 2)
    return int(line), key


def mistakes(tmp_path: Path, text: str) -> list[Place]:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    return [place(path, one) for one in check_file(path).mistakes]


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("repeats: 2", "repeats: two", (7, "steps[0].repeats")),
        ("repeats: 2", "repeats: 0", (7, "steps[0].repeats")),
        ("    repeats: 2\n", "", (5, "steps[0].repeats")),
        ("repeats: 2", "repeats: 2\n    colour: red", (8, "steps[0].colour")),
        ("[300, 600]", "[]", (6, "steps[0].standoffs_mm")),
        ("[300, 600]", "[300, far]", (6, "steps[0].standoffs_mm[1]")),
        ("[300, 600]", "300", (6, "steps[0].standoffs_mm")),
        ("[300, 600]", "[300, 600, 300]", (5, "steps[0]")),
        ("capture_grid", "capture_grd", (5, "steps[0].step")),
        ("title: P", "title: P\ntitle: Q", (4, "title")),
    ],
)
def test_one_mistake_is_reported_once(tmp_path: Path, old: str, new: str, found: Place) -> None:
    assert mistakes(tmp_path, changed(PROCEDURE, old, new)) == [found]


def test_an_unknown_kind_of_step_is_answered_with_the_nearest_names_first(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(changed(PROCEDURE, "capture_grid", "capture_grd"))
    (text,) = check_file(path).mistakes
    assert "capture_grid, capture_board, " in text


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("f_px: {value: 533.3, sd: 26.7} ", "f_px: 533.3 ", [(12, "camera.f_px")]),
        ("axis: u", "axis: w", [(22, "lasers[0].axis")]),
        ("id: L2", "id: L1", [(20, "lasers")]),
        (
            "seed: 2001",
            "seed: 2001\n  beam: {power_mw: 1 W, colour: red}\n  camera: {gain: 0.2}",
            [(61, "emulator.beam.power_mw"), (61, "emulator.beam.colour"), (62, "emulator.camera.gain")],
        ),
        ("seed: 2001", "seed: 2001\n  truth: {lasers: {L9: {x_mm: 3}}}", [(61, "emulator.truth")]),
        ("seed: 2001", "answers: true", [(59, "emulator.seed")]),
        ("emulator:\n  seed: 2001", "", [(1, "emulator.seed")]),
        ("driver: emulated", "driver: robot", [(6, "driver")]),
        (
            "driver: emulated",
            "driver: opencv+serial",
            [(1, "devices.camera.source"), (1, "devices.lasers.port")],
        ),
    ],
)
def test_mistakes_of_a_rig_and_of_its_drivers(tmp_path: Path, old: str, new: str, found: list[Place]) -> None:
    assert mistakes(tmp_path, changed(RIG, old, new)) == found


def test_mistakes_of_a_rig_do_not_hide_those_of_its_driver(tmp_path: Path) -> None:
    text = changed(changed(RIG, "axis: u", "axis: w"), "seed: 2001", "seed: none")
    assert [key for _, key in mistakes(tmp_path, text)] == ["lasers[0].axis", "emulator.seed"]
    text = changed(changed(RIG, "axis: u", "axis: w"), "driver: emulated", "driver: robot")
    assert [key for _, key in mistakes(tmp_path, text)] == ["driver", "lasers[0].axis"]


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("ty: {value: -0.19882", "ty: {value: 0.3", None),
        ("tx: {value: 0.0, sd: 0.019}", "tx: {value: 0.2, sd: 0.019}", "grating in one row"),
        (
            "y_mm: {value: 0.0, sd: 0.77}\n    tx: {value: 0.0, sd: 0.019}\n    ty: {value: -0.23363",
            "y_mm: {value: 10.0, sd: 0.77}\n    tx: {value: 0.0, sd: 0.019}\n    ty: {value: -0.23363",
            "got G03 and G01, which cross",
        ),
    ],
)
def test_beams_of_one_emitter_are_checked_with_the_rig(
    tmp_path: Path, old: str, new: str, wanted: str | None
) -> None:
    rig = (ROOT / "rigs/mars-rover-emulated.yaml").read_text()
    path = tmp_path / "f.yaml"
    path.write_text(changed(rig, old, new))
    found = check_file(path).mistakes
    if wanted is None:
        assert not found
    else:
        assert [place(path, one) for one in found] == [(26, "lasers[0].emitter")]
        assert wanted in found[0]


def test_a_device_block_is_checked_by_its_driver(tmp_path: Path) -> None:
    block = "devices:\n  camera: {source: 0, gain: loud}\n  lasers: {port: /dev/ttyACM0}\n"
    text = changed(RIG, "driver: emulated", "driver: opencv+serial") + block
    line = text[: text.index("gain: loud")].count("\n") + 1
    assert mistakes(tmp_path, text) == [(line, "devices.camera.gain")]


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError):
        check_file(tmp_path)


@pytest.mark.parametrize("text", [CALIBRATION, CSV, "a: 1\nb: 2\n", "lasers: []\n"])
def test_a_file_of_another_kind_is_one_mistake(tmp_path: Path, text: str) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    for load in (check_file, load_procedure, load_rig):
        with pytest.raises(BadInputError) as caught:
            load(path)
        (line,) = str(caught.value).splitlines()
        assert line.startswith(f"{path}:1: ")


def test_a_rig_is_refused_as_a_procedure() -> None:
    with pytest.raises(BadInputError, match="key procedure"):
        load_procedure(ROOT / "rigs/thesis-emulated.yaml")


def test_the_order_of_steps_is_checked_beside_other_mistakes(tmp_path: Path) -> None:
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
    assert mistakes(tmp_path, text) == [
        (2, "procedure"),
        (4, "steps[0]"),
        (5, "steps[1].file"),
        (6, "steps[2].limits.rms"),
        (8, "steps[3].standoffs_mm[1]"),
        (12, "title"),
    ]


@pytest.mark.parametrize("kind", ["capture_grd", "3", "[capture_grid]"])
def test_nothing_is_required_after_a_step_of_unknown_kind(tmp_path: Path, kind: str) -> None:
    """The unknown step may give what later steps need."""
    text = changed(PROCEDURE, "step: capture_grid", f"step: {kind}") + "  - {step: fit}\n  - {step: export}\n"
    ((line, key),) = mistakes(tmp_path, text)
    assert (line, key.removesuffix(".step")) == (5, "steps[0]")


def test_a_malformed_step_gives_what_its_kind_gives(tmp_path: Path) -> None:
    text = changed(PROCEDURE, "repeats: 2", "repeats: 0") + "  - {step: fit}\n"
    assert mistakes(tmp_path, text) == [(7, "steps[0].repeats")]


def test_a_retry_of_a_fit_is_refused(tmp_path: Path) -> None:
    text = (
        PROCEDURE
        + "  - step: fit\n  - step: check_limits\n    limits: {rms_px: {in: [0, 1], on_fail: retry}}\n"
    )
    assert mistakes(tmp_path, text) == [(10, "steps[2].limits")]


def test_notes_are_apart_from_mistakes(tmp_path: Path) -> None:
    """A trial without a calibration may be meant to follow another procedure."""
    path = tmp_path / "f.yaml"
    path.write_text(HEAD + "  - {step: accuracy_trial, standoffs_mm: [300], readings: 0}\n")
    found = check_file(path)
    assert [place(path, one) for one in found.mistakes] == [(5, "steps[0].readings")]
    assert [place(path, one) for one in found.notes] == [(5, "steps[0]")]


def test_the_files_of_the_project_are_good() -> None:
    for path in [*ROOT.glob("procedures/*.yaml"), *ROOT.glob("rigs/*.yaml")]:
        assert check_file(path).mistakes == ()
    trial = ROOT / "procedures/accuracy-flat.yaml"
    assert [place(trial, one) for one in check_file(trial).notes] == [(7, "steps[0]")]
