"""`workbench compare`."""

from __future__ import annotations

import json
from pathlib import Path

from tests.support.command_line import Run

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
    assert "same within uncertainty" in workbench("compare", a, again).err
    header, *rows = WEBCAM.read_text().splitlines()
    split = [row.rsplit(",", 1) for row in rows]
    c.write_text("\n".join([header, *(f"{left},{int(v_px) + 9}" for left, v_px in split)]) + "\n")
    workbench("fit", c, "--rig", WEBCAM_RIG, "-o", b)
    outcome = workbench("compare", a, b, "--json")
    result = json.loads(outcome.out)
    assert result["moved"]
    assert {"cy_px", "1.ty"} <= set(result["explanations"])
    assert "explained by" in outcome.err
