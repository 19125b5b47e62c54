"""`workbench range` of a captures file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_range_from_the_yaml_alone(workbench: Run, tmp_path: Path) -> None:
    calibration = tmp_path / "webcam.yaml"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
    outcome = workbench("range", WEBCAM, "--calibration", calibration, "--json")
    assert outcome.code == 0
    scenes = [json.loads(line) for line in outcome.out.splitlines()]
    assert len(scenes) == 9
    first = scenes[0]
    assert {"scene", "status", "closest_mm", "sigma_mm", "shape", "lasers", "notes"} <= set(first)
    assert (first["scene"], first["status"], first["shape"]) == ("row 2", "done", {"kind": "unknown"})
    (laser,) = first["lasers"]
    assert laser == {
        "id": "1",
        "range_mm": first["closest_mm"],
        "sigma_mm": first["sigma_mm"],
        "interval_mm": first["interval_mm"],
        "u_px": None,
        "v_px": 42.0,
    }
    # By hand: 32478 / (203.61 - 42), and r^2 / 32478 a pixel.
    assert first["closest_mm"] == pytest.approx(32478 / (203.61 - 42), rel=1e-3)
    assert "closest" in outcome.err


def test_without_json_the_list_is_standard_output(workbench: Run, tmp_path: Path) -> None:
    calibration = tmp_path / "c.yaml"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
    outcome = workbench("range", WEBCAM, "--calibration", calibration)
    assert outcome.code == 0
    assert "row 2" in outcome.out


def test_a_rig_is_no_calibration(workbench: Run) -> None:
    outcome = workbench("range", WEBCAM, "--calibration", WEBCAM_RIG)
    refused(outcome, 2, "expected a calibration, with the key laser_ranger; this is a rig")
    assert len(outcome.err.splitlines()) == 1


def test_every_laser_that_there_is_not_is_told(workbench: Run, tmp_path: Path) -> None:
    calibration, captures = tmp_path / "c.yaml", tmp_path / "c.csv"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
    captures.write_text("laser_id,standoff_mm,repeat,u_px,v_px\n8,,0,,99\n1,,0,,99\n9,,0,,99\n")
    outcome = workbench("range", captures, "--calibration", calibration)
    refused(outcome, 2, f"{captures}: row 2, column laser_id", f"{captures}: row 4, column laser_id")


def test_a_size_that_no_picture_has_is_refused(workbench: Run, tmp_path: Path) -> None:
    calibration = tmp_path / "c.yaml"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
    text = calibration.read_text()
    assert "image_width: 640" in text
    calibration.write_text(text.replace("image_width: 640", "image_width: 1" + 400 * "0"))
    outcome = workbench("range", WEBCAM, "--calibration", calibration)
    refused(outcome, 2, "image_width: expected at most 100000, got 1000")
