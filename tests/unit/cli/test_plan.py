"""`workbench check` and `workbench plan`."""

from __future__ import annotations

from pathlib import Path

import pytest

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
    ("step", "says"),
    [
        ("{step: ask, text: a, number: {unit: C, in: [50, 10]}}", "`in`: expected [lowest, highest]"),
        ("{step: ask, text: a, number: {unit: C, in: [50]}}", "steps[0].number.in[1]: is missing"),
        ("{step: ask, text: a, number: {unit: C, in: [1, 5], usual: 9}}", "`usual`: expected 1 to 5"),
        ("{step: ask, text: a, choices: [b, b]}", "`choices`: expected each once, got b, b"),
        (
            "{step: ask, text: a, choices: [b, Skip]}",
            "expected other words than redo, skip, abort, got skip",
        ),
        ("{step: accuracy_trial, standoffs_mm: [300, 300], readings: 1}", "standoffs_mm must differ"),
        ("{step: capture_grid, standoffs_mm: [300, 300.00000000000006], repeats: 1}", "must differ"),
        (
            "{step: capture_grid, standoffs_mm: [1.0e+300], repeats: 1}",
            "expected at most 1000000, got 1e+300",
        ),
        (f"{{step: warm_up, frames: 1{'0' * 400}}}", "frames: expected at most 1000000, got 1000"),
        ("{step: null}", "steps[0].step: expected one of "),
        ("fit", "steps[0]: expected keys and values, got 'fit'"),
        ("{step: message, text: a: b}", "put text with a colon in it in quotes"),
    ],
)
def test_steps_that_cannot_be(workbench: Run, tmp_path: Path, step: str, says: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{SHORT}  - {step}\n")
    rig = ROOT / "rigs/thesis-emulated.yaml"
    refused(workbench("check", path), 2, "p.yaml:5: ", says)
    refused(workbench("plan", path, "--rig", rig), 2, "p.yaml:5: ", says)


def test_a_rig_of_the_virtual_bench_that_cannot_be(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig.write_text(text.replace("seed: 2001", "seed: -1").replace("width_px: 640", "width_px: 9999999"))
    refused(
        workbench("check", rig),
        2,
        "width_px: expected at most 100000",
        "seed: expected at least 0, got -1",
    )


def test_a_number_that_no_computation_holds_is_refused(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(WEBCAM_RIG.read_text() + "board: {columns: 1" + 400 * "0" + "}\n")
    refused(workbench("check", rig), 2, "board.columns: expected at most 1000, got 1000")
