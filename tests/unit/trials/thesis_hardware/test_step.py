"""Step `thesis_comparison`."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, reading
from tests.support.procedures import plan_of
from tests.support.steps import parse_step
from workbench.model.errors import BadInputError
from workbench.model.event import TrialFinished


def test_it_needs_readings_of_an_earlier_step(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="readings") as caught:
        plan_of(tmp_path, a="  - {step: thesis_comparison}\n")
    assert caught.value.exit_code == 2


def test_table_and_figures_are_those_of_the_sessions_readings(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        session.context.readings += [reading(None, range_mm=502.0), reading(None, range_mm=499.0)]
        outcome = parse_step("step: thesis_comparison").run(session.context, "p.1")
        rows = pd.read_csv(session.context.session_dir / "p.1.csv", dtype={"figure": str})
        (event,) = [one for one in session.events if isinstance(one, TrialFinished)]
    flat = rows[(rows["figure"] == "33") & (rows["to_mm"] == 2000)].iloc[0]
    assert flat["ours"] == pytest.approx(100 * 1.5 / 500)
    assert flat["ratio"] == pytest.approx(0.003 / 0.025)
    assert flat["reached"] == "yes"
    assert [chart.name for chart in event.charts] == ["p.1-figure-33", "p.1-figure-34"]
    assert outcome.split()[0] == str(len(rows))
