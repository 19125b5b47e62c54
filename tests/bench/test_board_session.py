"""A session with the printed board, from the command line to the calibration, and its files fitted again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml as pyyaml

from workbench.model.calibration import load_calibration
from workbench.model.event import CaptureTaken, StepFinished
from workbench.session.journal import read_journal

pytestmark = pytest.mark.thorough
ROOT = Path(__file__).parents[2]
SCRIPT = Path(sys.executable).with_name("workbench")
PROCEDURE = """
format: 1
procedure: board-short
title: A short calibration on the board
steps:
  - step: capture_board
    frames: 8
    repeats: 1
    placings:
      - {standoff_mm: 200}
      - {standoff_mm: 330}
      - {standoff_mm: 280, yaw_deg: 35, standoff_sd_mm: 10}
      - {standoff_mm: 280, pitch_deg: -35, standoff_sd_mm: 10}
      - {standoff_mm: 900}
  - step: capture_grid
    standoffs_mm: [200, 600, 2200]
    repeats: 2
  - step: fit
  - step: export
"""
SEEDS = (2001,)


def workbench(*arguments: object) -> str:
    done = subprocess.run([SCRIPT, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module", params=SEEDS)
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("board")
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    (folder / "rig.yaml").write_text(text.replace("seed: 2001", f"seed: {request.param}"))
    (folder / "board.yaml").write_text(PROCEDURE)
    workbench("run", folder / "board.yaml", "--rig", folder / "rig.yaml", "--sessions", folder / "sessions")
    (found,) = [p for p in (folder / "sessions").iterdir() if p.is_dir()]
    return found


def test_the_focal_length_is_the_truth_s_and_the_data_s(session: Path) -> None:
    truth = pyyaml.safe_load(session.with_name(session.name + ".truth.yaml").read_text())
    calibration = load_calibration(session / "calibration.yaml")
    parameters = calibration.laser_ranger.parameters
    assert parameters.names[0] == "f_px"
    error = parameters.values[0] - truth["f_px"]
    assert abs(error) < 0.001 * truth["f_px"]
    assert abs(error) < 4 * parameters.sd[0]
    assert parameters.determined_by[0] == "data"
    assert parameters.data_share[0] > 0.99
    assert not any("focal length" in warning for warning in calibration.laser_ranger.fit.warnings)


def test_a_board_too_far_away_is_named_and_the_rest_goes_on(session: Path) -> None:
    events = [record.event for record in read_journal(session)]
    board = next(e.outcome for e in events if isinstance(e, StepFinished))
    assert "in 4 of 5 placements; board at 900 mm: expected at least 12" in board
    frames = [e for e in events if isinstance(e, CaptureTaken) and e.laser_id == "board"]
    assert len(frames) == 5 * 8
    assert all(e.off is None and (session / e.on.path).is_file() for e in frames)
    assert load_calibration(session / "calibration.yaml").laser_ranger.fit.rejected >= 4 + 1


def test_the_session_is_fitted_again_from_its_captures(session: Path, tmp_path: Path) -> None:
    said = workbench("fit", session, "-o", tmp_path / "again.yaml", "--details")
    assert "corners in 4 views" in said
    assert "the board at this placement was not found" in " ".join(said.split())
    again = load_calibration(tmp_path / "again.yaml").laser_ranger
    assert again.parameters == load_calibration(session / "calibration.yaml").laser_ranger.parameters
