"""The noise at a window's rim, told from those of its pixels that are used."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.fit import Windows, fit_spots
from workbench.spots.judging import _raise_floor
from workbench.spots.noise import Noise

HALF, WINDOWS = 5, 400
SIDE = 2 * HALF + 1
RIM = 8 * HALF


def windows(used: str, seed: int, sd: float = 1.0) -> Windows:
    """A clear spot in white noise, the rest of the window unusable."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIDE, :SIDE] - HALF
    spot = 400.0 * np.exp(-0.5 * (x**2 + y**2) / 1.3**2)
    data = spot + rng.normal(0.0, sd, (WINDOWS, SIDE, SIDE))
    usable = {"all": y < SIDE, "half": x <= 1, "corner": (x <= 2) & (y <= 2)}[used]
    shape = (WINDOWS, SIDE, SIDE)
    return Windows(data, np.broadcast_to(usable, shape).copy(), np.full(shape, np.inf))


@pytest.mark.parametrize(("used", "count"), [("all", 40), ("half", 11 + 2 * 6), ("corner", 15)])
def test_the_noise_at_the_rim_does_not_depend_on_how_much_of_it_is_used(used: str, count: int) -> None:
    win = windows(used, 1)
    start = np.tile([0.0, 4000.0, HALF, HALF, 0.3, 0.3], (WINDOWS, 1))
    judged = fit_spots(win, start, Noise(np.ones(WINDOWS), np.full(WINDOWS, 1e-3))).judged
    assert (judged[:, 8] == count).all()
    # The mean of `count` squared normal numbers has sd sqrt(2 / count); the fit takes the leverage of six
    # parameters, of which the background's share of the rim is the larger part: 4 % at most.
    assert judged[:, 1].mean() == pytest.approx(1.0, abs=0.06 + 4 * np.sqrt(2 / count / WINDOWS))


@pytest.mark.parametrize(("count", "reads", "raised"), [(40, 1.9, False), (40, 2.2, True), (20, 2.2, False)])
def test_a_rim_of_fewer_pixels_must_be_noisier_to_count(count: int, reads: float, raised: bool) -> None:
    judged, floor = np.zeros((1, 9)), np.ones(1)
    judged[0, 1], judged[0, 8] = reads, count
    assert _raise_floor(floor, judged) == raised
    assert floor[0] == (reads if raised else 1.0)


def test_a_rim_that_no_pixel_tells_of_leaves_the_floor_alone() -> None:
    floor = np.ones(1)
    assert not _raise_floor(floor, np.zeros((1, 9)))
    assert floor[0] == 1.0
