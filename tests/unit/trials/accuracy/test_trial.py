"""The run of the accuracy trial: its table and its chart."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.exact import calibration_of
from tests.support.running import Scripted, running
from tests.support.steps import parse_step
from workbench.model.errors import LimitFailedError
from workbench.model.event import TrialFinished
from workbench.model.prompt import Answer


def test_placements_that_are_left_out_have_no_row(tmp_path: Path) -> None:
    operator = Scripted({"p.1/400mm": [Answer(action="skip", reason="no room")]})
    step = parse_step("step: accuracy_trial, standoffs_mm: [300, 400, 500], readings: 2")
    with running(tmp_path, operator=operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        assert step.run(session.context, "p.1").startswith("4 ")
        rows = pd.read_csv(session.context.session_dir / "p.1.csv")
        (finished,) = [event for event in session.events if isinstance(event, TrialFinished)]
    assert rows["standoff_mm"].tolist() == [300.0, 500.0]
    assert rows["readings"].tolist() == [2, 2]
    # The bench is exact but for the placement, whose deviation the table states.
    sd_mm = rows["reference_sd_mm"].combine(rows["range_sd_mm"], lambda a, b: (a * a + b * b) ** 0.5)
    assert (rows["mean_error_mm"].abs() <= 5 * sd_mm).all()
    assert [chart.name for chart in finished.charts] == ["p.1-errors"]
    assert rows["mean_error_mm"].tolist() == pytest.approx([row[3] for row in finished.tables[1].rows])


def test_the_verdict_comes_first_and_details_stay_in_files(tmp_path: Path) -> None:
    step = parse_step("step: accuracy_trial, standoffs_mm: [300, 400, 500], readings: 2")
    with running(tmp_path) as session:
        session.context.calibration = calibration_of(session.context.rig)
        step.run(session.context, "p.1")
        (finished,) = [event for event in session.events if isinstance(event, TrialFinished)]
        files = {path.name for path in session.context.session_dir.glob("p.1*.csv")}
    names = [table.name for table in finished.tables]
    assert names == ["p.1-verdict", "p.1", "p.1-bias", "p.1-budget", "p.1-linearity"]
    assert {f"{name}.csv" for name in names} <= files


def test_a_limit_that_fails_ends_with_exit_code_3_after_the_tables(tmp_path: Path) -> None:
    text = "step: accuracy_trial, standoffs_mm: [300], readings: 2, limits: {mean_error_mm: {in: [50, 60]}}"
    with running(tmp_path) as session:
        session.context.calibration = calibration_of(session.context.rig)
        with pytest.raises(LimitFailedError) as caught:
            parse_step(text).run(session.context, "p.1")
        assert (session.context.session_dir / "p.1.csv").is_file()
    assert caught.value.exit_code == 3


def test_a_trial_with_every_placement_skipped_fails(tmp_path: Path) -> None:
    operator = Scripted({"p.1/300mm": [Answer(action="skip", reason="no room")]})
    step = parse_step("step: accuracy_trial, standoffs_mm: [300], readings: 2")
    with running(tmp_path, operator=operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        with pytest.raises(LimitFailedError):
            step.run(session.context, "p.1")
