"""Steps of a scanning head: their angles, placements, and mistakes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from tests.support.procedures import plan_of
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.trials.scanning.calibrate_step import CalibrateHeadStep
from workbench.trials.scanning.scan_step import ScanStep

ROOT = Path(__file__).parents[4]
SCAN: dict[str, Any] = {"step": "scan", "standoff_mm": 500, "from_deg": -1, "to_deg": 1, "step_deg": 0.1}
CALIBRATE: dict[str, Any] = {"step": "calibrate_head", "standoffs_mm": [300], "angles_deg": [0, 5]}


def test_two_calibrations_of_one_session_need_files_of_their_own(tmp_path: Path) -> None:
    """The second one would overwrite the head of the first."""
    rig = ROOT / "rigs/scanning-head-emulated.yaml"
    calibrate = "  - {step: calibrate_head, standoffs_mm: [300], angles_deg: [0, 5]%s}\n"
    with pytest.raises(BadInputError, match=r"b\.yaml: steps\[0\]: .* got head\.yaml, .*a\.yaml: steps\[0\]"):
        plan_of(tmp_path, rig, a=calibrate % "", b=calibrate % "")
    with pytest.raises(BadInputError, match=r"a\.yaml: steps\[1\]: .* got head-2\.yaml"):
        plan_of(tmp_path, rig, a=2 * (calibrate % ", file: head-2.yaml"))
    assert len(plan_of(tmp_path, rig, a=calibrate % "", b=calibrate % ", file: head-2.yaml").procedures) == 2


def test_an_arc_has_both_its_ends() -> None:
    angles = ScanStep.model_validate(SCAN).angles_deg
    assert len(angles) == 21
    assert (angles[0], angles[10], angles[-1]) == (-1.0, 0.0, 1.0)


def test_the_exposure_is_set_in_the_middle_of_the_arc() -> None:
    rig = load_rig(ROOT / "rigs/scanning-head-emulated.yaml")
    step = ScanStep.model_validate(SCAN | {"from_deg": -30, "to_deg": -10, "step_deg": 10})
    (placement,) = step.placements("p.1", rig)
    assert placement.head_deg == -20.0
    assert step.captures(rig) == 3


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"from_deg": 2}, "to_deg: expected more than from_deg, 2, got 1"),
        ({"step_deg": 1e-5}, "step_deg: expected at most 10000 angles, got 200000"),
        ({"to_deg": 90}, "less than or equal to 80"),
        ({"target": {"shape": "world"}}, "shape"),
    ],
)
def test_impossible_scans_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        ScanStep.model_validate(SCAN | keys)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"angles_deg": [0, 5, 0]}, "angles_deg: expected each angle once, got 0 deg more than once"),
        ({"standoffs_mm": [300, 300]}, "expected each standoff once"),
        ({"angles_deg": [0]}, "at least 2 items"),
        ({"file": "../head.yaml"}, "match pattern"),
        ({"file": "calibration.yaml"}, "match pattern"),
    ],
)
def test_impossible_calibrations_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        CalibrateHeadStep.model_validate(CALIBRATE | keys)


def test_the_procedures_fit_the_rig() -> None:
    rig = load_rig(ROOT / "rigs/scanning-head-emulated.yaml")
    for name in ("scan-calibrate", "scan-shape"):
        for step in load_procedure(ROOT / f"procedures/{name}.yaml").steps:
            for placement in step.placements(f"{name}.1", rig):
                assert placement.head_deg is not None
