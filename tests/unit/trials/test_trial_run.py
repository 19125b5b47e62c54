"""A running trial: other targets are named, readings outside their interval can be taken again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, finished
from tests.support.running import Running, Scripted
from tests.support.steps import parse_step
from workbench.model.errors import LimitFailedError
from workbench.model.event import LimitChecked, ReadingTaken, SetAside, TrialProgress
from workbench.model.prompt import Action, Answer, Prompt
from workbench.model.target import FlatTarget, Placement

TEXT = "step: accuracy_trial, standoffs_mm: [300, 400], readings: 2"
PRECISION = "step: repeatability_trial, standoffs_mm: [300, 400], placements: 3, repeats: 2"


def misplace(session: Running, key: str, times: int, **change: object) -> None:
    """Have the target placed otherwise than asked for, the first `times` at one placement."""
    place, left = session.context.bench.target.place, [times]

    def placed(asked: Placement) -> Placement:
        wrong = asked.key == key and left[0] > 0
        left[0] -= wrong
        place(asked.model_copy(update=change) if wrong else asked)
        return asked

    patch.object(session.context.bench.target, "place", placed).start()


@pytest.fixture(autouse=True)
def unpatched() -> Iterator[None]:
    yield
    patch.stopall()


def test_a_turned_target_is_named_at_once_and_in_the_result(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        misplace(session, "p.1/400mm", 1, target=FlatTarget(yaw_deg=25.0))
        parse_step(TEXT).run(session.context, "p.1")
        progress = [one.text for one in session.events if isinstance(one, TrialProgress)]
        tables = {table.name: table for table in finished(session).tables}
        remarks = pd.read_csv(session.context.session_dir / "p.1-remarks.csv")
    assert len(progress) == 1
    assert "400 mm" in progress[0]
    assert "+25.0" in progress[0]
    assert remarks["placement"].tolist() == ["p.1/400mm"]
    assert len(tables["p.1-remarks"].rows) == 1


def test_a_trial_without_remarks_has_no_table_of_them(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        parse_step(TEXT).run(session.context, "p.1")
        names = {table.name for table in finished(session).tables}
    assert "p.1-remarks" not in names
    assert "p.1-lost-spots" not in names


@pytest.mark.parametrize("action", ["redo", "skip", "done"])
def test_readings_outside_are_kept_or_taken_again_with_a_reason(tmp_path: Path, action: Action) -> None:
    """A target 30 mm away from the ruler's standoff."""
    answer = Answer(action=action, reason=None if action == "done" else "the card had slipped")
    operator = Scripted({"p.1/400mm/outside": [answer]})
    with calibrated(tmp_path, operator) as session:
        misplace(session, "p.1/400mm", 1, standoff_mm=430.0)
        if action == "redo":
            place_again(session, "p.1/400mm/outside")
        parse_step(TEXT).run(session.context, "p.1")
        kept = [one for one in session.context.readings if one.scene.startswith("p.1/400mm/")]
        aside = [one for one in session.events if isinstance(one, SetAside)]
        taken = [one for one in session.events if isinstance(one, ReadingTaken)]
        tables = {table.name: table for table in finished(session).tables}
    assert operator.keys.count("p.1/400mm/outside") == 1
    assert len(kept) == {"redo": 2, "skip": 0, "done": 2}[action]
    assert len(taken) == {"redo": 6, "skip": 4, "done": 4}[action]
    if action == "done":
        assert aside == []
        assert all(one.is_outside for one in kept)
        return
    assert len(aside) == 1
    assert "the card had slipped" in str(tables["p.1-remarks"].rows)


@pytest.mark.parametrize("key", ["p.1/400mm", "p.1/400mm/outside"])
@pytest.mark.parametrize("step", [TEXT, PRECISION])
def test_a_skipped_placement_leaves_the_limits_undecided(tmp_path: Path, key: str, step: str) -> None:
    """Skipped before its readings, or after them because the target stood 30 mm away."""
    key = key if step == TEXT else key.replace("p.1/", "p.1/01-")
    operator = Scripted({key: [Answer(action="skip", reason="no room")]})
    quantity = "mean_error_mm" if step == TEXT else "repeatability_sd_mm"
    with calibrated(tmp_path, operator) as session:
        misplace(session, key.removesuffix("/outside"), 1, standoff_mm=430.0)
        parse_step(f"{step}, limits: {{{quantity}: {{in: [-90, 90]}}}}").run(session.context, "p.1")
        found = [one.verdict for one in session.events if isinstance(one, LimitChecked)]
        titles = [table.title for table in finished(session).tables]
    assert set(found) == {"pass", "marginal"}
    assert step == PRECISION or "1 of 2" in titles[0]


def test_a_spot_that_was_expected_and_lost_fails_its_limit(tmp_path: Path) -> None:
    """The map of spots expects all four lasers; the beam of one is blocked at each standoff."""
    with calibrated(tmp_path) as session:
        place = session.context.bench.target.place
        blocked = {"blocked": ("L3",)}
        patch.object(
            session.context.bench.target, "place", lambda asked: place(asked.model_copy(update=blocked))
        ).start()
        with pytest.raises(LimitFailedError):
            parse_step(f"{TEXT}, limits: {{laser_error_mm: {{in: [-8, 8]}}}}").run(session.context, "p.1")
        lost = [one for one in session.events if isinstance(one, LimitChecked) and one.value is None]
        verdict = finished(session).tables[0]
    assert [one.verdict for one in lost] == ["fail", "fail"]
    (row,) = [row for row in verdict.records() if row["range"] == "L3"]
    assert (row["readings"], row["missing"], row["decision"]) == (0, 4, "fail")


def place_again(session: Running, key: str) -> None:
    """Have the operator put the target right before the readings are taken again."""
    ask = session.context.operator.ask

    def asked(prompt: Prompt) -> Answer:
        answer = ask(prompt)
        if prompt.key == key:
            session.context.bench.target.place(Placement(key="p.1/400mm", standoff_mm=400.0))
        return answer

    patch.object(session.context.operator, "ask", asked).start()
