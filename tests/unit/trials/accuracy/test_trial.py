"""The run of the accuracy trial: its table and its chart."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.exact import calibration_of
from tests.support.running import Scripted, running
from tests.support.steps import parse_step
from workbench.model.event import TrialFinished
from workbench.model.prompt import Answer
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.accuracy.trial import COLUMNS, accuracy_table


def test_every_statistic_is_a_column_with_its_unit() -> None:
    assert {column.key for column in COLUMNS} == {*AccuracyRow.__dataclass_fields__, "mean_relative_error"}
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)
    table = accuracy_table("p.1", [AccuracyRow(500.0, 3, 1, 0.5, 0.9, -0.1, 0.2, 0.3, 0.4)])
    assert table.name == "p.1"
    assert table.rows == ((500.0, 3, 1, 0.5, 0.9, -0.1, 0.2, 0.3, 0.4, 0.001),)


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
    assert rows["mean_error_mm"].tolist() == pytest.approx([row[3] for row in finished.tables[0].rows])
