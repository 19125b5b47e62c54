"""`workbench fit` of a camera alone, with photographs that others made."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.support.command_line import Run, refused
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[3]
CHESSBOARDS = ROOT / "data/opencv-chessboards"


def fitted(workbench: Run, rig: Path, output: Path) -> dict[str, Any]:
    outcome = workbench("fit", CHESSBOARDS / "captures.csv", "--rig", rig, "-o", output, "--json")
    assert outcome.code == 0, outcome.err
    result: dict[str, Any] = json.loads(outcome.out)
    result["by_name"] = {p["name"]: p for p in result["parameters"]}
    return result


def test_opencv_s_chessboards_come_out_as_its_own_calibration(workbench: Run, tmp_path: Path) -> None:
    result = fitted(workbench, CHESSBOARDS / "rig-as-opencv.yaml", tmp_path / "left.yaml")
    # `left_intrinsics.yml` beside the photographs.
    assert result["by_name"]["f_px"]["value"] == pytest.approx(535.9, abs=1.0)
    assert result["by_name"]["cx_px"]["value"] == pytest.approx(342.3, abs=1.0)
    assert result["by_name"]["cy_px"]["value"] == pytest.approx(235.6, abs=1.0)
    assert result["by_name"]["k1"]["value"] == pytest.approx(-0.266, abs=0.012)
    assert [view["name"] for view in result["views"] if view["suspect"]] == ["left02.jpg"]
    assert any("left02.jpg" in warning for warning in result["warnings"])


def test_corners_by_edges_fit_all_of_opencv_s_views(workbench: Run, tmp_path: Path) -> None:
    """OpenCV's own solver gives 533.3 px with these corners, and with its own in a window of 5 px 532.8."""
    output = tmp_path / "left.yaml"
    result = fitted(workbench, CHESSBOARDS / "rig.yaml", output)
    f = result["by_name"]["f_px"]
    assert f["value"] == pytest.approx(533.3, abs=1.0)
    assert f["sd"] < 0.6
    assert result["rms_px"] < 0.13
    assert not any(view["suspect"] for view in result["views"])
    assert [view["corners"] for view in result["views"]] == [54] * 13

    rig = tmp_path / "rig.yaml"
    rig.write_text(
        "format: 1\nrig: next\ncamera: {from: left.yaml}\n"
        "lasers:\n  - {id: 1, axis: u, x_mm: {value: 30, sd: 1}, y_mm: {value: 0, sd: 1}}\n"
    )
    camera = load_rig(rig).camera
    for name, prior in camera.lens_priors.items():
        stated = result["by_name"][name]
        assert prior.value == pytest.approx(stated["value"])
        assert prior.sd == pytest.approx(stated["sd"])


def test_photographs_of_an_aprilgrid_come_out_as_by_opencv_s_solver(workbench: Run, tmp_path: Path) -> None:
    folder = ROOT / "data/aprilgrid-photos"
    output = tmp_path / "camera.yaml"
    outcome = workbench("fit", folder / "captures.csv", "--rig", folder / "rig.yaml", "-o", output, "--json")
    assert outcome.code == 0, outcome.err
    result = json.loads(outcome.out)
    assert [view["corners"] for view in result["views"]] == [144] * 4
    by_name = {p["name"]: p for p in result["parameters"]}
    # cv2.calibrateCamera with the same corners, unweighted: 742.7 +- 1.8 px, centre (389.8, 511.0), k1 0.209.
    assert by_name["f_px"]["value"] == pytest.approx(742.7, abs=2 * np.hypot(1.8, by_name["f_px"]["sd"]))
    assert by_name["cx_px"]["value"] == pytest.approx(389.8, abs=3.0)
    assert by_name["cy_px"]["value"] == pytest.approx(511.0, abs=3.0)
    assert by_name["k1"]["value"] == pytest.approx(0.209, abs=0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"640": "320"}, "expected an image of 320 x 480"),
        ({"[9, 6]": "[8, 6]"}, "no view of the board"),
        ({"kind: chessboard": "kind: checkers"}, "chessboard"),
        ({"[9, 6]": "[3, 3]"}, "at least 12 corners"),
    ],
)
def test_wrong_rig_files_are_refused(
    workbench: Run, tmp_path: Path, change: dict[str, str], words: str
) -> None:
    text = (CHESSBOARDS / "rig.yaml").read_text()
    for old, new in change.items():
        text = text.replace(old, new)
    rig = tmp_path / "rig.yaml"
    rig.write_text(text)
    captures = tmp_path / "captures.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on\nboard,,0,left01.jpg\n")
    shutil.copy(CHESSBOARDS / "left01.jpg", tmp_path)
    outcome = workbench("fit", captures, "--rig", rig, "-o", tmp_path / "o.yaml")
    refused(outcome, 2, words)


def test_too_few_views_refuse_the_calibration(workbench: Run, tmp_path: Path) -> None:
    rows = (CHESSBOARDS / "captures.csv").read_text().splitlines()[:3]
    captures = tmp_path / "captures.csv"
    captures.write_text("\n".join(rows) + "\n")
    for name in ("left01.jpg", "left02.jpg"):
        shutil.copy(CHESSBOARDS / name, tmp_path)
    output = tmp_path / "o.yaml"
    outcome = workbench("fit", captures, "--rig", CHESSBOARDS / "rig.yaml", "-o", output)
    refused(outcome, 3, "2 views")
    assert not output.exists()
    accepted = workbench(
        "fit", captures, "--rig", CHESSBOARDS / "rig.yaml", "-o", output, "--accept", "a trial"
    )
    assert accepted.code == 0
    assert 'accepted_because: "a trial"' in output.read_text()


def test_a_view_without_the_board_is_listed_and_not_used(workbench: Run, tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    shutil.copytree(CHESSBOARDS, folder)
    cv2.imwrite(str(folder / "blank.jpg"), np.full((480, 640), 120, np.uint8))
    with (folder / "captures.csv").open("a") as file:
        file.write("board,,0,blank.jpg\n")
    outcome = workbench(
        "fit", folder / "captures.csv", "--rig", folder / "rig.yaml", "-o", tmp_path / "o.yaml", "--json"
    )
    assert outcome.code == 0
    (rejected,) = json.loads(outcome.out)["rejected"]
    assert rejected["source"] == "row 15"
    assert "blank.jpg" in rejected["reason"]


def test_other_commands_want_lasers(workbench: Run, tmp_path: Path) -> None:
    refused(workbench("design", "--rig", CHESSBOARDS / "rig.yaml"), 2, "lasers")
    checked = workbench("check", CHESSBOARDS / "rig.yaml")
    assert checked.code == 0
