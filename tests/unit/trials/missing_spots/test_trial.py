"""The run of the missing-spots trial on the noise-free bench."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, finished
from tests.support.steps import parse_step
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
