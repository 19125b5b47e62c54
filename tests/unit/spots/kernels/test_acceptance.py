"""The noise at a window's rim, told from those of its pixels that are used."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.draw import Drawn, draw
from workbench.spots import find_spots
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.acceptance import _follow_rim
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
    assert _follow_rim(floor, judged) == raised
    assert floor[0] == (reads if raised else 1.0)


@pytest.mark.parametrize(
    ("count", "reads", "lowered"), [(40, 0.26, False), (40, 0.22, True), (20, 0.12, False)]
)
def test_a_rim_must_be_much_quieter_to_count(count: int, reads: float, lowered: bool) -> None:
    """As rare as 5 sd of a Gaussian on one side: 2.9e-7."""
    judged, floor = np.zeros((1, 9)), np.ones(1)
    judged[0, 1], judged[0, 8] = reads, count
    assert _follow_rim(floor, judged) == lowered
    assert floor[0] == (reads if lowered else 1.0)
    assert (chi2(count).cdf(reads * count) < 2.9e-7) == lowered


@pytest.mark.parametrize("seed", [1, 2])
def test_in_a_dark_patch_of_a_bright_scene_the_deviation_is_that_of_the_patch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = np.full((60, 120), 1000.0)
    scene[15:45, 40:80] = 60.0
    z = []
    for _ in range(150):
        true = Drawn(60 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5), 3e3, 1.5, 1.5)
        on, off = draw([true], rng, ambient=scene), draw([], rng, ambient=scene)
        (spot,) = find_spots(on, off, expected=1, saturation_dn=4095).spots
        z += [(spot.u_px - true.u) / spot.u_sd_px, (spot.v_px - true.v) / spot.v_sd_px]
    assert 0.88 < np.std(z) < 1.12  # 300 values: 3 sd of their standard deviation are 0.12


def test_a_rim_that_no_pixel_tells_of_leaves_the_floor_alone() -> None:
    floor = np.ones(1)
    assert not _follow_rim(floor, np.zeros((1, 9)))
    assert floor[0] == 1.0
