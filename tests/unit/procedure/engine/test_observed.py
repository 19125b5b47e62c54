"""Observations of a running session, and the expected position of a missing spot."""

from __future__ import annotations

from pathlib import Path

from workbench.calibration.design.expected_spot import ExpectedSpot
from workbench.model.rig import load_rig
from workbench.procedure.engine.observed import expected_spot_text

RIG = load_rig(Path(__file__).parents[4] / "rigs/thesis-emulated.yaml")


def test_the_text_of_an_expected_spot_has_its_position_and_place() -> None:
    outside = expected_spot_text(RIG, "L4", ExpectedSpot(662.3, 248.4, 6.6, 3.6, "outside"))
    assert "u = 662 +- 7, v = 248 +- 4 px (1 sigma)" in outside
    assert "outside the image of 640 x 480" in outside
    inside = expected_spot_text(RIG, "L4", ExpectedSpot(600.0, 248.4, 6.6, 3.5, "inside"))
    assert "inside" in inside
    edge = expected_spot_text(RIG, "L4", ExpectedSpot(640.0, 248.4, 6.6, 3.5, "at the edge"))
    assert "at the edge" in edge
    assert len({text.rpartition(":")[2] for text in (outside, inside, edge)}) == 3, "advice differs"
