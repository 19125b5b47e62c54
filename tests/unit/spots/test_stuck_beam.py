"""Frames with all lasers off: a beam is refused, a known lamp is returned, noise is neither."""

from __future__ import annotations

import pytest

from workbench.model.errors import LaserOffNotConfirmedError
from workbench.spots import Spot, position_text, refuse_stuck_beam
from workbench.spots.persistence import SIGNIFICANT


def light(u_px: float, significance: float = 3 * SIGNIFICANT) -> Spot:
    """A spot of a given significance."""
    sd = 1.5 / significance
    return Spot(u_px, 50.0, sd, sd, 1000.0, 1.5, 100.0)


ADVICE = "measure it"
BEAM, FAINT = light(100.0), light(100.0, significance=0.6 * SIGNIFICANT)


def nothing() -> list[Spot]:
    return []


def not_needed() -> list[Spot]:
    pytest.fail("a clear light needs no second frame")


def test_a_clear_light_is_a_beam() -> None:
    with pytest.raises(LaserOffNotConfirmedError, match="k/00") as caught:
        refuse_stuck_beam("capture k/00", [BEAM], not_needed, ADVICE)
    assert position_text(BEAM) in str(caught.value)
    assert ADVICE in str(caught.value)


def test_a_faint_light_is_a_beam_if_it_is_there_again() -> None:
    with pytest.raises(LaserOffNotConfirmedError):
        refuse_stuck_beam("k", [FAINT], lambda: [FAINT], ADVICE)
    assert refuse_stuck_beam("k", [FAINT], nothing, ADVICE) == []
    assert refuse_stuck_beam("k", [FAINT], lambda: [light(140.0, 0.6 * SIGNIFICANT)], ADVICE) == []


def test_a_dark_frame_passes() -> None:
    assert refuse_stuck_beam("k", [], not_needed, ADVICE) == []


def test_a_known_lamp_passes_and_hides_no_beam() -> None:
    lamp = light(200.0)
    assert refuse_stuck_beam("k", [lamp], not_needed, ADVICE, lamps=[light(200.4)]) == [lamp]
    with pytest.raises(LaserOffNotConfirmedError) as caught:
        refuse_stuck_beam("k", [lamp, BEAM], not_needed, ADVICE, lamps=[lamp])
    assert position_text(BEAM) in str(caught.value)
