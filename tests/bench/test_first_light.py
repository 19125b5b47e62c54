"""The demo, from the files that a newcomer runs it with to a calibration that a ranger uses."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml as pyyaml

from tests.support.virtual_truth import parameter_values
from tests.viewer.harness import distinct_colors, headless_viewer
from tests.viewer.readback import Contents
from workbench.model.calibration import load_calibration
from workbench.model.event import (
    CaptureTaken,
    ReadingTaken,
    SessionFinished,
    SpotsFound,
    StandoffAdvised,
    StepStarted,
    TrialFinished,
)
from workbench.model.rig import load_rig
from workbench.sensor.calibrated import CalibratedSensor
from workbench.session.journal import read_journal
from workbench.viewer.recording import rebuild

ROOT = Path(__file__).parents[2]
SCRIPT = Path(sys.executable).with_name("workbench")
SEEDS = (2001,)


def workbench(*arguments: object, code: int = 0) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"COLUMNS": "80"}
    done = subprocess.run(
        [SCRIPT, *map(str, arguments)], capture_output=True, text=True, env=environment, cwd=ROOT
    )
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done


@dataclass(frozen=True)
class Demo:
    seed: int
    folder: Path
    rig: Path
    terminal: str

    @cached_property
    def truth(self) -> dict[str, Any]:
        """What the emulator hides from everything but the tests."""
        path = self.folder.with_name(self.folder.name + ".truth.yaml")
        truth: dict[str, Any] = pyyaml.safe_load(path.read_text())
        return truth


@pytest.fixture(scope="module", params=SEEDS)
def demo(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Demo:
    folder = tmp_path_factory.mktemp("demo")
    rig = folder / "rig.yaml"
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    assert "seed: 2001" in text
    rig.write_text(text.replace("seed: 2001", f"seed: {request.param}"))
    procedures = [ROOT / "procedures/calibrate-flat.yaml", ROOT / "procedures/accuracy-flat.yaml"]
    done = workbench("run", *procedures, "--rig", rig, "--sessions", folder / "sessions")
    assert done.stdout == ""
    (session,) = [p for p in (folder / "sessions").iterdir() if p.is_dir()]
    return Demo(request.param, session, rig, done.stderr)


@pytest.mark.parametrize("demo", SEEDS[:1], indirect=True)
def test_table_in_the_documentation_is_reproduced(demo: Demo) -> None:
    """Of the rig as it is; to a tenth of what is stated, for another processor rounds otherwise."""
    table = (ROOT / "docs/demo.md").read_text().partition("error = measured - true\n ")[2]
    rows = table.partition("─\n")[2].partition("a reading is")[0]
    shown = [[float(cell) for cell in line.split()] for line in rows.splitlines()]
    measured = pd.read_csv(demo.folder / "accuracy-flat.1.csv")
    for line, (_, row) in zip(shown, measured.iterrows(), strict=True):
        standoff, _, _, mean, largest, smallest, _, stated = line[:8]
        assert standoff == row["standoff_mm"]
        assert stated == pytest.approx(row["range_sd_mm"], rel=0.02, abs=0.005)
        ours = row[["mean_error_mm", "max_error_mm", "min_error_mm"]].tolist()
        assert (mean, largest, smallest) == pytest.approx(ours, abs=0.005 + 0.1 * stated)


def test_the_session_folder_holds_everything(demo: Demo) -> None:
    names = {p.name for p in demo.folder.iterdir()}
    assert names == {
        "session.yaml",
        "journal.jsonl",
        "frames",
        "captures.csv",
        "calibration.yaml",
        "trial-captures.csv",
        "accuracy-flat.1.csv",
        *(f"accuracy-flat.1-{table}.csv" for table in ("bias", "budget", "linearity", "verdict")),
        "accuracy-flat.1-errors.svg",
        "recording.rrd",
    }
    manifest = pyyaml.safe_load((demo.folder / "session.yaml").read_text())
    assert manifest["rig"]["text"] == demo.rig.read_text()
    assert manifest["versions"]["rerun-sdk"] == "0.41.0"


def test_every_laser_alone_ten_pairs_at_eight_standoffs_or_more(demo: Demo) -> None:
    shots = [r.event for r in read_journal(demo.folder) if isinstance(r.event, CaptureTaken)]
    calibration = [s for s in shots if s.purpose == "calibration"]
    standoffs = {s.standoff_mm for s in calibration}
    assert len(standoffs) >= 8
    assert (min(standoffs), max(standoffs)) == (125.0, 4500.0)
    assert len(calibration) == (len(standoffs) + 2) * 4 * 10  # two standoffs are visited again
    assert {s.laser_id for s in calibration} == {"L1", "L2", "L3", "L4"}
    assert all((demo.folder / f.path).is_file() for s in shots for f in (s.on, s.off) if f is not None)
    assert not standoffs & {s.standoff_mm for s in shots if s.purpose == "trial"}


def test_held_ranges_are_true_to_one_per_cent_up_to_two_metres(demo: Demo) -> None:
    """Against the truth: where the target really stood, counted from the true reference plane."""
    readings = [r.event for r in read_journal(demo.folder) if isinstance(r.event, ReadingTaken)]
    assert len(readings) == 55
    for reading in readings:
        placement = demo.truth["placements"][reading.scene.rsplit("/", 1)[0]]
        true_mm = reading.standoff_mm * (1 + demo.truth["ruler_scale"]) + placement["error_mm"]
        assert reading.status == "done"
        assert reading.range_mm is not None
        assert reading.sigma_mm is not None
        if reading.standoff_mm <= 2000:
            assert abs(reading.range_mm - true_mm) < 0.01 * true_mm
        assert abs(reading.range_mm - true_mm) < 5 * reading.sigma_mm


def test_the_truth_lies_where_the_calibration_says(demo: Demo) -> None:
    parameters = load_calibration(demo.folder / "calibration.yaml").laser_ranger.parameters
    truth = parameter_values(demo.truth)
    error = np.array(parameters.values) - np.array([truth[name] for name in parameters.names])
    free = np.array(parameters.prior_sd) > 0
    covariance = parameters.covariance_array[np.ix_(free, free)]
    distance2 = float(error[free] @ np.linalg.solve(covariance, error[free]))
    # Chi-square with one degree of freedom a parameter: mean n, variance 2 n.
    n = int(free.sum())
    assert distance2 < n + 4 * np.sqrt(2 * n)
    assert (error[~free] == 0).all()


def test_the_terminal_shows_steps_and_the_trial_in_80_columns(demo: Demo) -> None:
    above, _, _ = demo.terminal.partition("\nACCEPTED")  # the verdict is not wrapped without a terminal
    assert max(len(line) for line in above.splitlines() if "sessions/" not in line) <= 80
    for word in (
        "Capture at 11 standoffs",
        "accepted: rms",
        "Accuracy",
        "mean",
        "max",
        "min",
        "sd",
        "stated",
    ):
        assert word in demo.terminal
    (trial,) = [r.event for r in read_journal(demo.folder) if isinstance(r.event, TrialFinished)]
    assert "verdict" in trial.tables[0].name, "the verdict first"
    (table,) = [one for one in trial.tables if one.name == "accuracy-flat.1"]
    assert len(table.rows) == 11
    for row in range(len(table.rows)):
        for column in range(len(table.columns)):
            assert table.text(row, column) in demo.terminal


def test_fit_and_range_on_the_session_s_images_give_the_session_s_results(demo: Demo, tmp_path: Path) -> None:
    output = tmp_path / "again.yaml"
    workbench("fit", demo.folder / "captures.csv", "--rig", demo.rig, "-o", output)
    again, first = load_calibration(output), load_calibration(demo.folder / "calibration.yaml")
    assert again.laser_ranger.parameters == first.laser_ranger.parameters
    assert again.laser_ranger.provenance.captures_sha256 == first.laser_ranger.provenance.captures_sha256

    done = workbench("range", demo.folder / "trial-captures.csv", "--calibration", output, "--json")
    scenes = {scene["scene"]: scene for scene in map(json.loads, done.stdout.splitlines())}
    readings = [r.event for r in read_journal(demo.folder) if isinstance(r.event, ReadingTaken)]
    compared = 0
    for reading in readings:
        # Lasers with an ambiguous spot were captured alone, in a scene of their own.
        parts = [scenes[reading.scene], *filter(None, [scenes.get(f"{reading.scene}/alone")])]
        assert parts[-1]["status"] == "done"
        ours = {laser["id"]: laser["range_mm"] for part in parts for laser in part["lasers"]}
        # The last digits depend on how many spots the compiled program ranges at once.
        assert ours == pytest.approx({laser.laser_id: laser.range_mm for laser in reading.lasers}, rel=1e-9)
        compared += 1
    assert compared == 55


def test_its_recording_gives_its_calibration(demo: Demo, tmp_path: Path) -> None:
    output = tmp_path / "again.yaml"
    workbench("fit", demo.folder / "recording.rrd", "-o", output)
    again, first = load_calibration(output), load_calibration(demo.folder / "calibration.yaml")
    assert again.laser_ranger.parameters == first.laser_ranger.parameters


def test_each_placement_tells_how_far_the_captures_have_come(demo: Demo) -> None:
    """From the second on; the last says of the ranges what the fit then does."""
    advised = [r.event for r in read_journal(demo.folder) if isinstance(r.event, StandoffAdvised)]
    assert [one.placements for one in advised] == list(range(2, 14))
    assert advised[0].relative_range_sd > advised[0].limit == 0.03 > advised[-1].relative_range_sd
    stated = load_calibration(demo.folder / "calibration.yaml").laser_ranger.validity.max_relative_range_sd
    assert advised[-1].relative_range_sd == pytest.approx(stated, rel=0.05)
    assert all(one.then_relative_range_sd < one.relative_range_sd for one in advised)
    assert all(100 <= one.next_standoff_mm <= 5000 for one in advised)
    assert all((one.worst_residual_sd or 0.0) > 0.0 for one in advised)
    assert "; worst residual 0." in advised[-1].text
    assert advised[-1].text in " ".join(demo.terminal.split())


def test_a_reader_written_from_the_format_s_description_ranges_alike(demo: Demo, tmp_path: Path) -> None:
    """`docs/examples/read_calibration.py`: PyYAML and numpy, nothing of the workbench."""
    records = [r.event for r in read_journal(demo.folder)]
    found = [s for event in records if isinstance(event, SpotsFound) for s in event.spots]
    spots = {(s.u_px, s.v_px): f"{s.u_px!r},{s.v_px!r},{s.u_sd_px!r},{s.v_sd_px!r}" for s in found}
    sds = {(s.u_px, s.v_px): (s.u_sd_px, s.v_sd_px) for s in found}
    sensor = CalibratedSensor(load_calibration(demo.folder / "calibration.yaml"))
    lasers = [laser for event in records if isinstance(event, ReadingTaken) for laser in event.lasers]
    rows = [f"{laser.laser_id},{spots[laser.u_px or 0.0, laser.v_px or 0.0]}" for laser in lasers]
    table = tmp_path / "spots.csv"
    table.write_text("\n".join(["laser_id,u_px,v_px,u_sd_px,v_sd_px", *rows]) + "\n")
    script = ROOT / "docs/examples/read_calibration.py"
    command = [sys.executable, str(script), str(demo.folder / "calibration.yaml"), str(table)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    theirs = [line.split() for line in done.stdout.splitlines()]
    assert [laser_id for laser_id, _, _ in theirs] == [laser.laser_id for laser in lasers]
    assert len(lasers) >= 200
    for (_, range_mm, sigma_mm), laser in zip(theirs, lasers, strict=True):
        assert float(range_mm) == pytest.approx(laser.range_mm, abs=0.05 * float(sigma_mm))
        (u_px, v_px), sd_px = (laser.u_px, laser.v_px), sds[laser.u_px or 0.0, laser.v_px or 0.0]
        expected = sensor.ranges([laser.laser_id], np.array([[u_px, v_px]], float), np.array([sd_px]))
        assert float(sigma_mm) == pytest.approx(expected.sigma_mm[0], rel=1e-6)
        assert float(range_mm) == pytest.approx(expected.range_mm[0], rel=1e-6)


@pytest.mark.thorough
def test_the_recording_is_a_view_that_can_be_made_again(demo: Demo, tmp_path: Path) -> None:
    again = tmp_path / "again.rrd"
    rebuild(demo.folder, load_rig(demo.rig), read_journal(demo.folder), again)
    first, second = Contents(demo.folder / "recording.rrd"), Contents(again)
    assert first.everything() == second.everything()


@pytest.mark.thorough
def test_the_recording_opens_in_the_real_viewer(demo: Demo, tmp_path: Path) -> None:
    with headless_viewer(tmp_path, "1600x900") as viewer:
        viewer.open(demo.folder / "recording.rrd")
        for tab in viewer.tabs():
            viewer.show_tab(tab)
            assert viewer.problems() == []
            assert distinct_colors(viewer.shot()) > 50


def test_the_session_says_how_it_ended(demo: Demo) -> None:
    records = list(read_journal(demo.folder))
    assert records[-1].event == SessionFinished(exit_code=0, message="done")
    assert [r.n for r in records] == list(range(len(records)))
    steps = [r.event.step for r in records if isinstance(r.event, StepStarted)]
    assert steps == ["message", "capture_grid", "fit", "export", "accuracy_trial"]


def test_the_calibration_reaches_the_whole_frame(demo: Demo) -> None:
    sensor = CalibratedSensor(load_calibration(demo.folder / "calibration.yaml"))
    assert sensor.in_frame("L2", np.array([300.0, 4500.0])).all()
