"""Step `thesis_comparison`."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, reading
from tests.support.procedures import plan_of
from tests.support.rigs import thesis_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError, LimitFailedError
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


@pytest.mark.parametrize(
    ("limit", "fails"),
    [
        ("goal_ratio: {in: [0, 0.7]}", False),
        ("goal_ratio: {in: [0, 0.5]}", True),
        ("thesis_ratio: {in: [0, 0.13]}", False),
        ("thesis_ratio: {in: [0, 0.1]}", True),
        ("goals_missed: {in: [0, 0]}", False),
    ],
)
def test_limits_decide_on_the_rows_with_readings(tmp_path: Path, limit: str, fails: bool) -> None:
    """The error is 0.3 %: the smallest goal 0.5 %, the thesis 2.5 % to 2 m. Inclines have no readings."""
    with calibrated(tmp_path) as session:
        session.context.readings += [reading(None, range_mm=502.0), reading(None, range_mm=499.0)]
        step = parse_step(f"step: thesis_comparison, limits: {{{limit}}}")
        if not fails:
            step.run(session.context, "p.1")
            return
        with pytest.raises(LimitFailedError) as caught:
            step.run(session.context, "p.1")
        assert caught.value.exit_code == 3
        assert (session.context.session_dir / "p.1.csv").exists()


def test_limits_may_ask() -> None:
    step = parse_step("step: thesis_comparison, limits: {goals_missed: {in: [0, 0], on_fail: ask}}")
    assert [prompt.key for prompt in step.prompts("p.1", thesis_rig())] == ["p.1/goals_missed"]
    assert wrong_keys("step: thesis_comparison, limits: {goals_missed: {in: [0, 0], on_fail: retry}}") != []
