"""`workbench run`."""

from __future__ import annotations

from pathlib import Path

from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_a_rig_without_a_driver(workbench: Run, tmp_path: Path) -> None:
    procedure = ROOT / "procedures/calibrate-flat.yaml"
    outcome = workbench("run", procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
    refused(outcome, 2, "webcam-laser: expected `devices`, or a `driver`")


def test_one_procedure_twice(workbench: Run, tmp_path: Path) -> None:
    procedure = ROOT / "procedures/calibrate-flat.yaml"
    outcome = workbench("run", procedure, procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
    refused(outcome, 2, "procedure: ", "got calibrate-flat")
    assert list(tmp_path.iterdir()) == []
