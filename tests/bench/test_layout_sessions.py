"""Whole sessions of other layouts on the virtual bench: calibration, and readings within their intervals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml as pyyaml

from tests.crash.short import CALLER
from tests.support.virtual_truth import parameter_values
from workbench.model.calibration import load_calibration
from workbench.model.rig import load_rig
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[2]
PROCEDURE = """\
format: 1
procedure: layout
title: Layout
steps:
  - step: capture_grid
    standoffs_mm: [150, 280, 600, 1400, 3000]
    repeats: 2
  - step: fit
    limits: {max_relative_range_sd: 0.1}
  - step: export
  - step: accuracy_trial
    standoffs_mm: [200, 450, 1000]
    readings: 2
"""
ROWS = {
    "diagonal": ["45 deg"],
    "three-lines": ["horizontal", "60 deg", "120 deg"],
    "mars-rover": ["vertical"],
}


@pytest.fixture(scope="module", params=[*ROWS, "ring"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp(request.param)
    procedure = folder / "layout.yaml"
    procedure.write_text(PROCEDURE)
    rig = ROOT / f"rigs/{request.param}-emulated.yaml"
    run(Plan.load(rig, [procedure]), folder / "s", (), CALLER, lambda: None)
    return request.param, folder / "s"


def true_range_mm(truth: dict[str, Any], placement: str, standoff_mm: float, laser_id: str) -> float:
    """Range of a beam's point on the target as it truly stood, by the ray equation."""
    placed, ray = truth["placements"][placement], truth["lasers"][laser_id]
    mx = np.tan(np.radians(placed["yaw_deg"] + truth["target_yaw_deg"]))
    my = np.tan(np.radians(placed["pitch_deg"] + truth["target_pitch_deg"]))
    offset_mm = truth["offset_mm"]
    z0 = standoff_mm * (1 + truth["ruler_scale"]) + placed["error_mm"] + offset_mm
    depth = (z0 + mx * ray["x_mm"] + my * ray["y_mm"]) / (1 - mx * ray["tx"] - my * ray["ty"])
    return float(depth - offset_mm)


def truth_of(folder: Path) -> dict[str, Any]:
    truth: dict[str, Any] = pyyaml.safe_load(folder.with_name("s.truth.yaml").read_text())
    return truth


@pytest.mark.long_cases
def test_the_calibration_agrees_with_the_truth(session: tuple[str, Path]) -> None:
    layout, folder = session
    calibration = load_calibration(folder / "calibration.yaml")
    assert calibration.laser_ranger.fit.verdict == "accepted"
    parameters, values = calibration.laser_ranger.parameters, parameter_values(truth_of(folder))
    true = np.array([values[name] for name in parameters.names])
    free = np.array(parameters.sd) > 0
    z = (np.array(parameters.values) - true)[free] / np.array(parameters.sd)[free]
    assert np.abs(z).max() < 4.5
    rows = [row.name for row in CalibratedSensor(calibration).rows if len(row.members) > 1]
    assert rows == ROWS.get(layout, [])


def test_ranges_lie_within_their_stated_intervals(session: tuple[str, Path]) -> None:
    layout, folder = session
    ids, truth = load_rig(ROOT / f"rigs/{layout}-emulated.yaml").laser_ids, truth_of(folder)
    events = [json.loads(line)["event"] for line in (folder / "journal.jsonl").read_text().splitlines()]
    readings = [one for one in events if one["kind"] == "reading_taken"]
    assert len(readings) == 6
    inside = []
    for reading in readings:
        assert reading["status"] == "done"
        assert [one["laser_id"] for one in reading["lasers"]] == list(ids)
        placement = reading["scene"].rpartition("/")[0]
        for one in reading["lasers"]:
            true = true_range_mm(truth, placement, reading["standoff_mm"], one["laser_id"])
            assert abs(one["range_mm"] - true) < 5 * one["sigma_mm"]
            inside.append(one["low_mm"] <= true <= one["high_mm"])
    # 95 % in the long run; the lasers of one session share the error of its calibration.
    assert np.mean(inside) >= 0.8


def test_beams_of_one_emitter_share_their_frames_and_others_have_their_own(session: tuple[str, Path]) -> None:
    layout, folder = session
    table = pd.read_csv(folder / "captures.csv")
    frames = table.groupby("on")["laser_id"].nunique()
    assert set(frames) == ({15} if layout == "mars-rover" else {1})
    assert len(table) == 5 * 2 * table["laser_id"].nunique()
