"""`workbench compare`."""

from __future__ import annotations

import json
from pathlib import Path

from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_compare(workbench: Run, tmp_path: Path) -> None:
    a, b, c = tmp_path / "a.yaml", tmp_path / "b.yaml", tmp_path / "c.csv"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", a)
    same = workbench("compare", a, a, "--json")
    assert (same.code, json.loads(same.out)["moved"]) == (0, False)
    assert "identical" in same.err
    again = tmp_path / "again.yaml"
    again.write_text(a.read_text().replace("max_relative_range_sd: 0.", "max_relative_range_sd: 0.0"))
    assert "same within uncertainty" in workbench("compare", a, again).out
    header, *rows = WEBCAM.read_text().splitlines()
    split = [row.rsplit(",", 1) for row in rows]
    c.write_text("\n".join([header, *(f"{left},{int(v_px) + 9}" for left, v_px in split)]) + "\n")
    workbench("fit", c, "--rig", WEBCAM_RIG, "-o", b)
    outcome = workbench("compare", a, b, "--json")
    result = json.loads(outcome.out)
    assert result["moved"]
    assert {"cy_px", "1.ty"} <= set(result["explanations"])
    assert "explained by" in outcome.err


def test_other_rigs_and_serial_numbers_are_noted(workbench: Run, tmp_path: Path) -> None:
    a, b = tmp_path / "a.yaml", tmp_path / "b.yaml"
    text = (ROOT / "data/session-0.1.0/calibration.yaml").read_text()
    a.write_text(text)
    b.write_text(text.replace('"emulated-1"', '"emulated-2"'))
    assert json.loads(workbench("compare", a, a, "--json").out)["notes"] == []
    outcome = workbench("compare", a, b, "--json")
    (note,) = json.loads(outcome.out)["notes"]
    assert outcome.code == 0
    assert "emulated-1" in note
    assert "emulated-2" in note
    b.write_text(text.replace('"thesis-emulated"', '"another"'))
    (note,) = json.loads(workbench("compare", a, b, "--json").out)["notes"]
    assert "another" in note


def test_other_image_sizes_are_refused(workbench: Run, tmp_path: Path) -> None:
    a, b = ROOT / "data/session-0.1.0/calibration.yaml", tmp_path / "b.yaml"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", b)
    refused(workbench("compare", a, b), 2)
