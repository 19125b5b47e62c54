"""Exposure that follows the brightness of the last capture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.running import running
from workbench.model.exposure import AIM
from workbench.model.target import FlatTarget, Placement
from workbench.procedure.engine.placements import visit_placements
from workbench.trials.brightness import LARGEST_CHANGE, SPOTLESS_CHANGE, follow_brightness


@pytest.mark.parametrize(
    ("peak_share", "factor"),
    [
        (AIM / 2, 2.0),
        (min(2 * AIM, 1.0), AIM / min(2 * AIM, 1.0)),
        (AIM / 100, LARGEST_CHANGE),
        (None, SPOTLESS_CHANGE),
    ],
)
def test_the_exposure_is_scaled_to_the_aim(tmp_path: Path, peak_share: float | None, factor: float) -> None:
    with running(tmp_path) as session:
        context = session.context

        def work(placed: Placement) -> float:
            context.capture(f"{placed.key}/0", ["L1"], placed, 0, [])
            taken = context.captures[-1]
            finding = context.findings[taken.key]
            full = 2**context.rig.camera.bits - 1
            spots = () if peak_share is None else (replace(finding.spots[0], peak_dn=peak_share * full),)
            context.findings[taken.key] = replace(finding, spots=spots)
            before = taken.exposure
            assert before is not None
            follow_brightness(context)
            context.capture(f"{placed.key}/1", ["L1"], placed, 1, [])
            after = context.captures[-1].exposure
            assert after is not None
            return after / before

        placement = Placement(key="p/400mm", standoff_mm=400.0, target=FlatTarget())
        (ratio,) = visit_placements(context, [placement], work)
    assert ratio == pytest.approx(factor, rel=0.01)
