"""`workbench range --rig`: readings from a bench."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.session.manifest import load_manifest

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"
CALIBRATION = SESSION / "calibration.yaml"


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """The rig of a recorded session."""
    path = tmp_path / "rig.yaml"
    path.write_text(load_manifest(SESSION).rig.text)
    return path


def test_each_reading_is_a_line_of_json(workbench: Run, rig: Path) -> None:
    live = ("range", "--rig", rig, "--calibration", CALIBRATION, "--json")
    outcome = workbench(*live, "--readings", 3, "--standoff", 800)
    assert outcome.code == 0, outcome.err
    readings = [json.loads(line) for line in outcome.out.splitlines()]
    assert [(one["scene"], one["status"]) for one in readings] == [(str(n), "done") for n in range(3)]
    for one in readings:
        # The placement adds to what the reading states: 0.3 mm, and half a degree of tilt over 60 mm.
        assert abs(one["mean_mm"] - 800.0) < 4 * (one["mean_sigma_mm"] ** 2 + 0.3**2 + 0.5**2) ** 0.5


def test_a_calibration_of_another_sensor_is_refused(workbench: Run, rig: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(rig.read_text().replace("id: L4", "id: L9"))
    refused(workbench("range", "--rig", other, "--calibration", CALIBRATION, "--readings", 1), 2, "L9")


def test_live_options_need_a_rig(workbench: Run) -> None:
    captures = SESSION / "trial-captures.csv"
    refused(workbench("range", captures, "--calibration", CALIBRATION, "--readings", 1), 2, "--readings")
    refused(workbench("range", "--calibration", CALIBRATION), 2, "--rig")
