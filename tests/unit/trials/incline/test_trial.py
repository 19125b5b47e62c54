"""The run of the incline trial on the noise-free bench."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, finished
from tests.support.running import Scripted
from tests.support.steps import parse_step
from workbench.model.event import ReadingTaken
from workbench.model.prompt import Answer
from workbench.trials.incline.common_tilt import CommonTilt
from workbench.trials.incline.trial import tilt_table

TEXT = (
    "step: incline_trial, ranges_mm: [300, 400], readings: 2,"
    " targets: [{kind: incline, angle_deg: 30, reference_sd_deg: 0},"
    " {kind: incline, angle_deg: -50, reference_sd_deg: 0}]"
)


def test_range_and_angle_are_those_of_the_target(tmp_path: Path) -> None:
    skipped = Scripted({"p.1/v-50deg-400mm": [Answer(action="skip", reason="no room")]})
    with calibrated(tmp_path, skipped) as session:
        parse_step(TEXT).run(session.context, "p.1")
        ranges, angles, differences = (
            pd.read_csv(session.context.session_dir / f"p.1{suffix}.csv")
            for suffix in ("", "-angle", "-difference")
        )
        event = finished(session)
        taken = [one for one in session.events if isinstance(one, ReadingTaken)]
    assert ranges["angle_deg"].tolist() == [30.0, 30.0, -50.0]
    assert ranges["true_mm"].tolist() == pytest.approx([300.0, 400.0, 300.0], abs=0.05)
    # The centroid of a spot on an inclined target is off by some hundredths of a pixel.
    assert ranges["mean_error_mm"].abs().max() < 0.5
    assert angles["mean_error_deg"].abs().max() < 0.25
    assert (angles["readings"] == 2).all()
    assert differences[["asked_mm", "first_deg", "second_deg"]].to_numpy().tolist() == [[300.0, 30.0, -50.0]]
    assert [chart.name for chart in event.charts] == ["p.1-errors", "p.1-angles"]
    assert [one.true.angle_deg for one in taken if one.true is not None] == [30.0] * 4 + [-50.0] * 2
    assert session.context.readings == taken


def test_the_tilt_of_the_mount_stands_with_the_keys_of_the_rig_file() -> None:
    tilt = CommonTilt("vertical", 0.62, 0.16, 0.31)
    (table,) = tilt_table("p.1", [tilt])
    (row,) = table.records()
    assert (table.name, row["tilt_deg"], row["sd_deg"]) == ("p.1-tilt", 0.62, 0.16)
    assert row["rig_keys"] == tilt.rig_keys
    assert tilt_table("p.1", []) == []
