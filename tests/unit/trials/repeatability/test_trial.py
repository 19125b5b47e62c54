"""The run of the repeatability trial: readings, table and charts."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.exact import calibration_of
from tests.support.running import Scripted, running, two_laser_rig, with_emulator
from tests.support.steps import parse_step
from workbench.model.errors import BadInputError
from workbench.model.event import TrialFinished
from workbench.model.prompt import Answer
from workbench.trials.reading_frame import COLUMNS
from workbench.trials.repeatability.table import precision_table


def test_readings_and_statistics_are_files_of_the_session(tmp_path: Path) -> None:
    operator = Scripted({"p.1/02-500mm": [Answer(action="skip", reason="no room")]})
    step = parse_step("step: repeatability_trial, standoffs_mm: [300, 500], placements: 3, repeats: 2")
    with running(tmp_path, operator=operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        assert step.run(session.context, "p.1").startswith("10 ")
        folder = session.context.session_dir
        readings = pd.read_csv(folder / "p.1.csv", dtype={"session": str})
        table = pd.read_csv(folder / "p.1-table.csv")
        (finished,) = [event for event in session.events if isinstance(event, TrialFinished)]
    assert tuple(readings.columns) == COLUMNS
    placements = readings.groupby("standoff_mm")["placement"].unique()
    assert {mm: list(numbers) for mm, numbers in placements.items()} == {300.0: [1, 2, 3], 500.0: [1, 2]}
    assert table["readings"].tolist() == [6, 4]
    assert [chart.name for chart in finished.charts] == ["p.1-errors", "p.1-precision"]
    # The file holds every digit: its statistics are those of the session.
    assert precision_table("p.1-table", readings) == finished.tables[0]


def test_re_placement_is_the_larger_component_on_a_bench_without_noise(tmp_path: Path) -> None:
    step = parse_step("step: repeatability_trial, standoffs_mm: [400], placements: 4, repeats: 2")
    rig, placement_sd_mm = two_laser_rig(), 0.5
    bench = rig.bench.model_copy(update={"placement_sd_mm": placement_sd_mm})
    with running(tmp_path, rig.model_copy(update={"bench": bench})) as session:
        session.context.calibration = calibration_of(session.context.rig)
        step.run(session.context, "p.1")
        table = pd.read_csv(session.context.session_dir / "p.1-table.csv")
    assert table["repeatability_sd_mm"][0] < 0.1 * table["placement_sd_mm"][0]
    # Four placements: s_L within the 99.99 % interval of chi-square with 3 degrees of freedom.
    assert 0.02 < table["placement_sd_mm"][0] / placement_sd_mm < 2.8


def test_dither_is_asked_between_repeats(tmp_path: Path) -> None:
    operator = Scripted()
    step = parse_step(
        "step: repeatability_trial, standoffs_mm: [400], placements: 2, repeats: 2, dither_mm: 3"
    )
    with running(tmp_path, operator=operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        step.run(session.context, "p.1")
        prompts = [prompt.key for prompt in step.prompts("p.1", session.context.rig)]
    asked = [key for key in operator.keys if key.startswith("p.1")]
    assert sorted(asked) == sorted(key for key in prompts if not key.endswith("/outside"))
    assert asked.index("p.1/01-400mm/dither-01") < asked.index("p.1/02-400mm")


def test_dither_adds_speckle_to_the_scatter_of_repeats(tmp_path: Path) -> None:
    rig = with_emulator(two_laser_rig(), beam={"speckle_contrast": 1.0})
    sds_mm = []
    for text in ("", ", dither_mm: 2"):
        folder = tmp_path / (text.strip(", :") or "still")
        folder.mkdir()
        step = parse_step(f"step: repeatability_trial, standoffs_mm: [600], placements: 4, repeats: 4{text}")
        with running(folder, rig) as session:
            session.context.calibration = calibration_of(rig)
            step.run(session.context, "p.1")
            table = pd.read_csv(session.context.session_dir / "p.1-table.csv")
        sds_mm.append(table["repeatability_sd_mm"][0])
    assert sds_mm[1] > 3 * sds_mm[0]


def test_without_a_calibration_nothing_is_captured(tmp_path: Path) -> None:
    step = parse_step("step: repeatability_trial, standoffs_mm: [400]")
    with running(tmp_path) as session, pytest.raises(BadInputError):
        step.run(session.context, "p.1")
