"""`workbench design`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


class TestDesign:
    """Before any data."""

    RIG = ROOT / "rigs/thesis-emulated.yaml"

    def test_the_given_standoffs_are_predicted(self, workbench: Run) -> None:
        outcome = workbench(
            "design", "--rig", self.RIG, "--standoffs", "125, 400,4500", "--repeats", 5, "--json"
        )
        assert outcome.code == 0
        result = json.loads(outcome.out)
        assert result["standoffs_mm"] == [125.0, 400.0, 4500.0]
        assert result["repeats"] == 5
        keys = {"name", "unit", "prior_sd", "sd", "data_share", "determined_by"}
        assert all(set(p) == keys and p["sd"] <= p["prior_sd"] for p in result["parameters"])
        assert {r["laser_id"] for r in result["ranges"]} == {"L1", "L2", "L3", "L4"}
        assert result["worst_relative_sd"] > result["worst_relative_sd_of_calibration"] > 0
        (of_f,) = [d for d in result["directions"] if next(iter(d["change"])) == "f_px"]
        assert of_f["words"] in " ".join(outcome.err.split())
        assert max(len(line) for line in outcome.err.splitlines()) <= 80

    def test_without_standoffs_some_are_proposed(self, workbench: Run) -> None:
        outcome = workbench("design", "--rig", WEBCAM_RIG, "--count", 4, "--json")
        assert outcome.code == 0
        assert len(json.loads(outcome.out)["standoffs_mm"]) == 4
        assert "proposed standoffs (mm)" in outcome.err

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (("--standoffs", "125,16o"), "millimetres separated by commas, such as 125,160,210, got '16o'"),
            (("--standoffs", ""), "millimetres separated by commas"),
            (("--standoffs", "nan"), "100 to 5000 mm (bench.reach_mm of the rig file), got nan"),
            (("--standoffs", "50,200"), "100 to 5000 mm (bench.reach_mm of the rig file), got 50"),
            (("--standoffs", "200,300,200"), "every standoff once, got 200 twice"),
            (("--standoffs", "200", "--count", 3), "--standoffs or --count, not both"),
            (("--repeats", 0), "'--repeats': expected a whole number of at least 1, such as 10, got 0"),
            (("--count", 0), "'--count': expected a whole number of at least 1, such as 10, got 0"),
            (("--count", 100), "got 100"),
        ],
    )
    def test_bad_options(self, workbench: Run, options: tuple[object, ...], words: str) -> None:
        refused(workbench("design", "--rig", self.RIG, *options), 2, words)

    def test_a_standoff_with_nothing_in_the_picture(self, workbench: Run, tmp_path: Path) -> None:
        rig = tmp_path / "rig.yaml"
        text = self.RIG.read_text().replace(
            "placement_sd_mm: 0.3", "placement_sd_mm: 0.3\n  reach_mm: [5, 5000]"
        )
        rig.write_text(text)
        outcome = workbench("design", "--rig", rig, "--standoffs", "10,500")
        refused(outcome, 2, "standoff 10 mm:")

    def test_a_reach_that_is_none(self, workbench: Run, tmp_path: Path) -> None:
        rig = tmp_path / "rig.yaml"
        text = self.RIG.read_text().replace(
            "placement_sd_mm: 0.3", "placement_sd_mm: 0.3\n  reach_mm: [900, 100]"
        )
        rig.write_text(text)
        refused(workbench("design", "--rig", rig), 2, "bench.reach_mm", "expected [nearest, farthest] in mm")
