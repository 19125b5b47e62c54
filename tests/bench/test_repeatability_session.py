"""A repeatability trial on the virtual bench: a whole session, and one that is killed and resumed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.crash.short import ROOT, write_files
from tests.support.killed_session import trial_finished
from workbench.trials.any_sensor.readings_file import load_readings
from workbench.trials.gauge_rr.table import gauge_table
from workbench.trials.repeatability.table import precision_table

PROCEDURE = """\
format: 1
procedure: own
title: Two trials
steps:
  - step: capture_grid
    standoffs_mm: [300, 600, 1500]
    repeats: 1
  - step: fit
    limits: {max_relative_range_sd: 0.5}
  - step: export
  - step: repeatability_trial
    standoffs_mm: [400, 700]
    placements: 3
    repeats: 2
    dither_mm: 2
  - step: gauge_rr_trial
    standoffs_mm: [400, 700]
    operators: [Ann, Bob]
    trials: 2
"""
REPEATABILITY, GAUGE = "own.4", "own.5"
FILES = [f"{name}{end}.csv" for name in (REPEATABILITY, GAUGE) for end in ("", "-table")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a rig, a calibration and both trials."""
    folder = tmp_path_factory.mktemp("trials")
    write_files(folder, PROCEDURE)
    return folder


def command(folder: Path, sessions: str) -> list[str]:
    workbench = str(Path(sys.executable).with_name("workbench"))
    files = [str(folder / "p.yaml"), "--rig", str(folder / "rig.yaml")]
    return [workbench, "run", *files, "--sessions", str(folder / sessions)]


@pytest.fixture(scope="module")
def session(folder: Path) -> Path:
    subprocess.run(command(folder, "whole"), check=True, capture_output=True, cwd=ROOT)
    (only,) = [path for path in (folder / "whole").iterdir() if path.is_dir()]
    return only


def test_statistics_follow_from_the_file_of_readings(session: Path) -> None:
    events = {name: trial_finished(session, name) for name in (REPEATABILITY, GAUGE)}
    readings = {name: load_readings(session / f"{name}.csv") for name in events}
    assert (
        precision_table(f"{REPEATABILITY}-table", readings[REPEATABILITY]) == events[REPEATABILITY].tables[0]
    )
    assert gauge_table(f"{GAUGE}-table", readings[GAUGE]) == events[GAUGE].tables[0]
