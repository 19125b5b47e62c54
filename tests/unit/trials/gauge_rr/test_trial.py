"""The run of the gauge R&R trial."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from tests.support.exact import calibration_of
from tests.support.running import Scripted, running
from tests.support.steps import parse_step
from workbench.model.event import TrialFinished
from workbench.trials.gauge_rr.table import gauge_table
from workbench.trials.reading_frame import COLUMNS


def test_readings_name_their_operator_and_trial(tmp_path: Path) -> None:
    operator = Scripted()
    step = parse_step("step: gauge_rr_trial, standoffs_mm: [300, 500], operators: [Ann, Bob], trials: 2")
    with running(tmp_path, operator=operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        assert step.run(session.context, "p.1").startswith("8 ")
        readings = pd.read_csv(session.context.session_dir / "p.1.csv")
        assert (session.context.session_dir / "p.1-table.csv").is_file()
        (finished,) = [event for event in session.events if isinstance(event, TrialFinished)]
    assert tuple(readings.columns) == COLUMNS
    assert readings["session"].tolist() == ["Ann", "Ann", "Bob", "Bob"] * 2
    assert readings["placement"].tolist() == [1] * 4 + [2] * 4
    assert gauge_table("p.1-table", readings) == finished.tables[0]
    assert [chart.name for chart in finished.charts] == ["p.1-errors"]
    asked = [key for key in operator.keys if key.startswith("p.1/")]
    assert asked[:4] == ["p.1/operator-01", "p.1/01-300mm", "p.1/01-500mm", "p.1/operator-02"]
