"""Observations of a running session, and where a spot that was not found is expected."""

from __future__ import annotations

from pathlib import Path

from workbench.calibration.design.expected_spot import ExpectedSpot
from workbench.model.rig import load_rig
from workbench.procedure.engine.observed import in_words

RIG = load_rig(Path(__file__).parents[4] / "rigs/thesis-emulated.yaml")


def test_what_is_said_of_it() -> None:
    outside = in_words(RIG, "L4", ExpectedSpot(662.3, 248.4, 6.6, 3.6, "outside"))
    assert "u = 662 +- 7, v = 248 +- 4 px (1 sigma), outside the picture of 640 x 480" in outside
    assert "nothing is wrong" in outside
    inside = in_words(RIG, "L4", ExpectedSpot(600.0, 248.4, 6.6, 3.5, "inside"))
    assert "is L4 lit" in inside
    assert "nothing is wrong" not in inside
    edge = in_words(RIG, "L4", ExpectedSpot(640.0, 248.4, 6.6, 3.5, "at the edge"))
    assert "if it is outside" in edge
