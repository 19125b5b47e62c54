"""Trials of targets with an existing calibration: a session, and the same one killed and resumed."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.bench.sensors import calibration_of
from tests.crash.short import ROOT
from workbench.calibration.verdict.export import render
from workbench.model.event import CalibrationLoaded, ReadingTaken, TrialFinished
from workbench.model.rig import load_rig
from workbench.session.journal import read_journal

SCRIPT = Path(sys.executable).with_name("workbench")
RIG = ROOT / "rigs/thesis-emulated.yaml"
PROCEDURE = """\
format: 1
procedure: targets
title: Targets
steps:
  - step: accuracy_trial
    standoffs_mm: [400]
    readings: 1
  - step: missing_spots_trial
    ranges_mm: [400]
    missing: [1, 3]
    readings: 2
  - step: incline_trial
    ranges_mm: [300]
    targets: [{kind: incline, angle_deg: 30}, {kind: incline, angle_deg: 60}]
    readings: 2
  - step: round_trial
    ranges_mm: [250, 350]
    target: {kind: cylinder, diameter_mm: 178}
    readings: 2
  - step: thesis_comparison
  - step: verify_trial
    standoffs_mm: [300, 700]
    readings: 1
"""


@dataclass(frozen=True)
class Bench:
    """Procedure and calibration, and the folder of an undisturbed session."""

    folder: Path
    whole: Path

    def arguments(self, sessions: str) -> list[str]:
        files = [self.folder / "targets.yaml", "--rig", RIG, "--calibration", self.folder / "c.yaml"]
        return [str(SCRIPT), "run", *map(str, files), "--sessions", str(self.folder / sessions)]


def call(*arguments: str) -> None:
    done = subprocess.run(
        arguments, capture_output=True, text=True, env=os.environ | {"COLUMNS": "80"}, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("targets")
    (folder / "targets.yaml").write_text(PROCEDURE)
    (folder / "c.yaml").write_text(render(calibration_of(load_rig(RIG))))
    call(*Bench(folder, folder).arguments("whole"))
    (whole,) = [path for path in (folder / "whole").iterdir() if path.is_dir()]
    return Bench(folder, whole)


def test_every_trial_ends_with_ranges_angles_and_radii(bench: Bench) -> None:
    events = [record.event for record in read_journal(bench.whole)]
    assert sum(isinstance(event, CalibrationLoaded) for event in events) == 1
    readings = [event for event in events if isinstance(event, ReadingTaken)]
    assert len(readings) == 1 + 3 * 2 + 2 * 2 + 2 * 2 + 3
    assert all(reading.range_mm is not None for reading in readings)
    for reading in readings:
        if reading.true is not None and reading.true.angle_deg is not None:
            # Some five expected deviations: calibration, spots, reference, common tilt of the target.
            assert reading.angle_deg == pytest.approx(reading.true.angle_deg, abs=5.0)
        if reading.true is not None and reading.true.radius_mm is not None:
            assert reading.radius_sd_mm is not None
            assert reading.radius_mm == pytest.approx(reading.true.radius_mm, abs=5 * reading.radius_sd_mm)
    trials = [event.trial for event in events if isinstance(event, TrialFinished)]
    assert trials == [f"targets.{n}" for n in range(1, 7)]
    assert (bench.whole / "targets.5-figure-41.svg").is_file()
