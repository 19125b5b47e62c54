"""`workbench check` and `workbench plan`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.short import write_files
from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"
SHORT = """\
format: 1
procedure: p
title: P
steps:
"""


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ("{step: ask, text: a, number: {unit: C, in: [50, 10]}}", "steps[0].number"),
        ("{step: ask, text: a, number: {unit: C, in: [50]}}", "steps[0].number.in[1]"),
        ("{step: ask, text: a, number: {unit: C, in: [1, 5], usual: 9}}", "steps[0].number"),
        ("{step: ask, text: a, choices: [b, b]}", "steps[0]"),
        ("{step: ask, text: a, choices: [b, Skip]}", "steps[0]"),
        ("{step: accuracy_trial, standoffs_mm: [300, 300], readings: 1}", "steps[0]"),
        ("{step: capture_grid, standoffs_mm: [300, 300.00000000000006], repeats: 1}", "steps[0]"),
        ("{step: capture_grid, standoffs_mm: [1.0e+300], repeats: 1}", "steps[0].standoffs_mm[0]"),
        (f"{{step: warm_up, frames: 1{'0' * 400}}}", "steps[0].frames"),
        ("{step: null}", "steps[0].step"),
        ("fit", "steps[0]"),
        ("{step: message, text: a: b}", "not valid YAML"),
    ],
)
def test_wrong_steps_are_refused_with_line_and_key(
    workbench: Run, tmp_path: Path, step: str, key: str
) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{SHORT}  - {step}\n")
    rig = ROOT / "rigs/thesis-emulated.yaml"
    refused(workbench("check", path), 2, f"p.yaml:5: {key}: ")
    refused(workbench("plan", path, "--rig", rig), 2, f"p.yaml:5: {key}: ")


def test_check_prints_notes_before_the_error_and_not_in_it(workbench: Run, tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{SHORT}  - {{step: accuracy_trial, standoffs_mm: [300], readings: 0}}\n")
    outcome = workbench("check", path)
    assert outcome.code == 2
    lines = outcome.err.splitlines()
    assert [line.split(": ")[0] for line in lines] == ["note", "error"]
    assert lines[1].startswith(f"error: {path}:5: steps[0].readings: ")


def test_mistakes_of_a_rig_and_of_its_virtual_bench_are_reported_together(
    workbench: Run, tmp_path: Path
) -> None:
    rig = tmp_path / "rig.yaml"
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig.write_text(text.replace("seed: 2001", "seed: -1").replace("width_px: 640", "width_px: 9999999"))
    refused(workbench("check", rig), 2, "camera.width_px: ", "emulator.seed: ")


def test_a_number_that_no_computation_holds_is_refused(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(WEBCAM_RIG.read_text() + "board: {columns: 1" + 400 * "0" + "}\n")
    refused(workbench("check", rig), 2, "board.columns: ")


def test_plan_states_the_age_of_an_existing_calibration(workbench: Run, tmp_path: Path) -> None:
    rig, procedure = write_files(
        tmp_path, f"{SHORT}  - {{step: accuracy_trial, standoffs_mm: [300], readings: 2}}\n"
    )
    calibration = ROOT / "data/session-0.1.0/calibration.yaml"
    refused(workbench("plan", procedure, "--rig", rig), 2, "--calibration")
    outcome = workbench("plan", procedure, "--rig", rig, "--calibration", calibration)
    assert outcome.code == 0
    assert "days old" in " ".join(outcome.out.split())
    rig.write_text(rig.read_text().replace("serial: emulated-1", "serial: emulated-9"))
    refused(workbench("plan", procedure, "--rig", rig, "--calibration", calibration), 2, "emulated-9")


@pytest.mark.parametrize(("standoff_mm", "is_lost"), [(400, False), (105, True)])
def test_plan_names_the_spots_that_a_trial_will_lose(
    workbench: Run, tmp_path: Path, standoff_mm: int, is_lost: bool
) -> None:
    """The beams at 60 mm leave an image of 640 pixels at 100 mm, and one of 600 pixels at 107 mm."""
    rig, procedure = write_files(
        tmp_path,
        f"{SHORT}  - {{step: capture_grid, standoffs_mm: [300, 600], repeats: 1}}\n  - {{step: fit}}\n"
        f"  - {{step: export}}\n  - {{step: accuracy_trial, standoffs_mm: [{standoff_mm}], readings: 2}}\n",
    )
    rig.write_text(rig.read_text().replace("width_px: 640", "width_px: 600"))
    outcome = workbench("plan", procedure, "--rig", rig)
    assert outcome.code == 0
    assert (f"p.4/{standoff_mm}mm" in outcome.out) == is_lost
