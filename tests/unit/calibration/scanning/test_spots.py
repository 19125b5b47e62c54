"""Mean spots of a scanning head."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.calibration.data.observations import Observation
from workbench.calibration.scanning.spots import head_spots
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig

RIG = load_rig(Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml")


def seen(placement: str, standoff_mm: float, repeat: int, u_px: float) -> Observation:
    return Observation(
        "c",
        "S",
        placement,
        standoff_mm,
        repeat,
        u_px,
        240.0,
        0.1,
        0.1,
        u_speckle_sd_px=0.03,
        v_speckle_sd_px=0.03,
    )


def test_repeats_of_a_move_are_averaged_and_moves_are_not() -> None:
    moves = [(seen("a", 400.0, n, 100.0 + 0.1 * n), 5.0) for n in range(3)]
    moves += [(seen("a", 400.0, 0, 200.0), 10.0), (seen("b", 700.0, 0, 150.0), 5.0)]
    spots, rejected = head_spots(RIG, moves)
    assert not rejected
    assert [one.key for one in spots.placements] == ["a", "b"]
    assert [one.standoff_mm for one in spots.placements] == [400.0, 700.0]
    np.testing.assert_array_equal(spots.placement, [0, 0, 1])
    np.testing.assert_array_equal(spots.reading_deg, [5.0, 10.0, 5.0])
    np.testing.assert_allclose(spots.position_px[:, 0], [100.1, 200.0, 150.0])
    # Noise falls with the number of repeats; speckle, which they share, does not.
    np.testing.assert_allclose(spots.sd_px[:, 0], np.hypot(0.1 / np.sqrt([3, 1, 1]), 0.03))
    np.testing.assert_allclose(np.degrees(spots.data.reading_rad), spots.reading_deg)
    np.testing.assert_array_equal(spots.data.standoff_mm, [400.0, 400.0, 700.0])


def test_an_outlier_among_the_repeats_is_rejected() -> None:
    moves = [(seen("a", 400.0, n, 100.0 + (5.0 if n == 4 else 0.01 * n)), 5.0) for n in range(12)]
    spots, (outlier,) = head_spots(RIG, moves)
    assert "median of its repeats" in outlier.reason
    assert spots.position_px[0, 0] < 101.0


def test_two_standoffs_of_one_placement_are_refused() -> None:
    moves = [(seen("a", 400.0, 0, 100.0), 5.0), (seen("a", 500.0, 1, 100.0), 5.0)]
    with pytest.raises(BadInputError, match="standoff"):
        head_spots(RIG, moves)
