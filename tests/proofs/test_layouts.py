"""Comparison of layouts, at a small size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs.layouts import FRONT_MM, KINDS, RIGS, in_view, missed, nearest_mm, resolution_line, rods
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[2]


def rig(name: str) -> Rig:
    return load_rig(ROOT / f"rigs/{name}-emulated.yaml")


def test_the_nearest_range_is_that_of_the_outermost_spot_at_the_edge() -> None:
    """Of the thesis's line: f b over half the image's width."""
    assert nearest_mm(rig("thesis")) == pytest.approx(533.3 * 60.0 / 320.0, abs=0.2)
    for name in RIGS:
        nearest = nearest_mm(rig(name))
        assert in_view(rig(name), nearest + 0.2)
        assert not in_view(rig(name), nearest - 0.2)


@pytest.mark.parametrize("kind", KINDS)
def test_rods_cross_the_vehicle(kind: str) -> None:
    normal, offset = rods(kind, np.random.default_rng(1), 200)
    corners = np.array([(x, y) for x in FRONT_MM[0] for y in FRONT_MM[1]])
    side = normal @ corners.T - offset[:, None]
    assert ((side.min(axis=1) <= 0) & (side.max(axis=1) >= 0)).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_missed_rods_of_the_line_are_those_between_its_beams(seed: int) -> None:
    """Four beams over 180 mm meet vertical rods of 20 mm in 80 mm, over 100 mm horizontal ones in 20 mm."""
    count = 4000
    for kind, share in (("vertical", 1 - 80 / 180), ("horizontal", 1 - 20 / 100)):
        found = missed(rig("thesis"), kind, np.random.default_rng(seed), count) / count
        assert found == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / count))


def test_a_row_of_the_resolution_has_shares_that_grow_with_the_range() -> None:
    name, *cells = resolution_line("diagonal", rig("diagonal"), 1, 1).split(" | ")
    one, together = np.array(cells[:-1], float).reshape(3, 2).T
    assert name == "diagonal"
    assert (np.diff(one) > 0).all()
    assert (together < one).all()
