"""Order of the beams of one emitter, compared with that of their spots by OpenCV's projection."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from tests.support.rigs import World, grating_rig, prior
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.optics.emitters import beams_in_order, beams_together, depths_mm, emitter_problems

REACH_MM = (100.0, 3000.0)


def fan(*beams: tuple[float, float], offset_mm: float = 0.0) -> Rig:
    """Beams of one emitter in a vertical plane beside the camera: y and ty of each."""
    rig = grating_rig({"y_mm": prior(y, 0.0), "ty": prior(ty, 0.0)} for y, ty in beams)
    bench = rig.bench.model_copy(update={"reach_mm": REACH_MM, "offset_mm": prior(offset_mm, 0.0)})
    return rig.model_copy(update={"bench": bench})


def crossing_at(depth_mm: float) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Three beams, of which the first two cross at a depth."""
    return (10.0, -0.02), (10.0 - 0.08 * depth_mm, 0.06), (40.0, 0.3)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_order_is_that_of_the_spots_at_every_depth(order: tuple[int, ...]) -> None:
    beams = [(0.0, -0.1), (-20.0, -0.15), (5.0, 0.2)]
    rig = fan(*(beams[n] for n in order))
    world = World(rig, 1)
    in_order, direction = beams_in_order(rig, beams_together(rig, rig.lasers[0]))
    for standoff_mm in np.geomspace(*REACH_MM, 7):
        along = [np.dot(world.pixel(laser.id, standoff_mm), direction) for laser in in_order]
        assert along == sorted(along)


@pytest.mark.parametrize("depth_mm", [110.0, 1000.0, 1500.0, 2900.0])
def test_beams_that_cross_within_the_reach_are_refused_by_name(depth_mm: float) -> None:
    rig = fan(*crossing_at(depth_mm))
    with pytest.raises(BadInputError, match="got G1 and G0, which cross") as caught:
        beams_in_order(rig, rig.lasers)
    assert "cross within 100 to 3000 mm" in str(caught.value)
    assert caught.value.exit_code == 2
    assert [index for index, _ in emitter_problems(rig)] == [0]


@pytest.mark.parametrize("depth_mm", [60.0, 3500.0])
def test_beams_that_cross_beyond_the_reach_have_an_order(depth_mm: float) -> None:
    rig = fan(*crossing_at(depth_mm))
    first = "G1" if depth_mm > REACH_MM[1] else "G0"
    assert beams_in_order(rig, rig.lasers)[0][0].id == first
    assert not list(emitter_problems(rig))


def test_the_reach_counts_from_the_reference_plane_and_depths_from_the_pinhole() -> None:
    beams = crossing_at(110.0)
    assert depths_mm(fan(*beams, offset_mm=20.0)) == (120.0, 3020.0)
    assert depths_mm(fan(*beams, offset_mm=-200.0))[0] == 1.0
    assert not list(emitter_problems(fan(*beams, offset_mm=20.0)))


def test_beams_in_no_row_are_refused_and_lasers_of_their_own_are_not() -> None:
    rig = fan((0.0, -0.1), (0.0, 0.0), (0.0, 0.1))
    astray = rig.lasers[1].model_copy(update={"tx": prior(0.3, 0.005)})
    rig = rig.model_copy(update={"lasers": (rig.lasers[0], astray, rig.lasers[2])})
    ((index, error),) = emitter_problems(rig)
    assert (index, "emitter g in one row, got" in str(error)) == (0, True)
    alone = tuple(laser.model_copy(update={"emitter": None}) for laser in rig.lasers)
    assert not list(emitter_problems(rig.model_copy(update={"lasers": alone})))
