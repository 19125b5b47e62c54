"""The run of the missing-spots trial on the noise-free bench."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, finished
from tests.support.running import Scripted
from tests.support.steps import parse_step
from workbench.model.errors import LimitFailedError
from workbench.model.event import CaptureTaken, ReadingTaken


def test_lasers_are_left_off_in_turn_and_ranges_stay_true(tmp_path: Path) -> None:
    text = "step: missing_spots_trial, ranges_mm: [500], readings: 4, missing: [1, 3]"
    with calibrated(tmp_path) as session:
        parse_step(text).run(session.context, "p.1")
        taken = [one for one in session.events if isinstance(one, ReadingTaken)]
        captures = [one for one in session.events if isinstance(one, CaptureTaken)]
        summary = pd.read_csv(session.context.session_dir / "p.1-summary.csv")
        event = finished(session)
    assert [one.left_off for one in taken[:4]] == [()] * 4
    assert [one.left_off for one in taken[4:8]] == [("L1",), ("L2",), ("L3",), ("L4",)]
    seen = [{laser.laser_id for laser in one.lasers} for one in taken[8:]]
    assert seen == [{"L4"}, {"L3"}, {"L2"}, {"L1"}]
    assert len({one.scene for one in taken}) == 12
    assert [one.range_mm for one in taken] == pytest.approx([500.0] * 12, abs=0.2)
    assert summary["left_off"].tolist() == [0, 1, 3]
    assert summary["readings"].tolist() == [4, 4, 4]
    assert all(one.left_off == () or one.laser_id not in one.left_off for one in captures)
    assert len(event.charts[0].series) == 3


def test_beams_are_blocked_set_after_set_and_freed_at_the_end(tmp_path: Path) -> None:
    text = "step: missing_spots_trial, ranges_mm: [500], readings: 8, blocked: [1, 3]"
    operator = Scripted()
    with calibrated(tmp_path, operator) as session:
        step = parse_step(text)
        step.run(session.context, "p.1")
        taken = [one for one in session.events if isinstance(one, ReadingTaken)]
        summary = pd.read_csv(session.context.session_dir / "p.1-summary.csv")
        planned = [prompt.key for prompt in step.prompts("p.1", session.context.rig)]
    keys = [key for key in operator.keys if "blocked" in key]
    assert keys == [key for key in planned if "blocked" in key]
    assert len(keys) == 4 + 4 + 1
    assert [one.blocked for one in taken[8:16]] == [(f"L{n}",) for n in (1, 1, 2, 2, 3, 3, 4, 4)]
    for one in taken[8:]:
        assert {laser.laser_id for laser in one.lasers}.isdisjoint(one.blocked)
    assert len({one.scene for one in taken}) == 24
    assert summary[["left_off", "blocked"]].to_numpy().tolist() == [[0, 0], [0, 1], [0, 3]]


def test_a_blocked_beam_is_switched_on(tmp_path: Path) -> None:
    """Unlike a laser that is left off."""
    text = "step: missing_spots_trial, ranges_mm: [500], readings: 1, blocked: [1]"
    with calibrated(tmp_path) as session:
        parse_step(text).run(session.context, "p.1")
        captures = [one for one in session.events if isinstance(one, CaptureTaken)]
    assert all(one.left_off == () for one in captures)


def test_a_limit_on_the_ratio_is_checked(tmp_path: Path) -> None:
    limits = "limits: {lost: {in: [0.5, 1]}}"
    text = f"step: missing_spots_trial, ranges_mm: [500], readings: 4, missing: [3], {limits}"
    with calibrated(tmp_path) as session, pytest.raises(LimitFailedError, match="lost"):
        parse_step(text).run(session.context, "p.1")
