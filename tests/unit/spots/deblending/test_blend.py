"""Spots whose light mixes are separated, and clear neighbours are kept."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw, profile
from workbench.spots import Failure, Scanline, find_spots

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("apart", [2.6, 3.5, 5.0, 8.0])
def test_overlapping_spots_are_separated(apart: float) -> None:
    true = [Drawn(50, 30, 4e4), Drawn(50 + apart, 30.2, 2e4)]
    finding = find_spots(draw(true, rng(3), ambient=5.0), scanlines=ROW, expected=2)
    assert len(finding.spots) == 2
    for spot, t in zip(finding.spots, true, strict=True):
        assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)
    assert (Failure.MERGED in finding.failures) == (apart < 4 * 1.3)


CROWDS = {
    "three side by side": [(13.8, 20.0), (13.9, 24.1), (8.8, 22.7), (21.3, 23.7)],
    "a merged pair and two more": [(13.8, 16.7), (14.4, 24.5), (24.6, 22.9), (27.6, 22.2)],
    "two merged pairs": [(13.4, 20.6), (16.7, 20.6), (23.3, 20.6), (26.6, 20.6)],
}
"""Places of four lasers' spots on a target far away, u and v."""


SPECKLE = 0.2


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("crowd", CROWDS)
def test_a_crowd_of_spots_is_told_apart(crowd: str, seed: int) -> None:
    """In speckle, whose noise hides the neighbours of a spot from a model that lacks them."""
    places, random = sorted(CROWDS[crowd]), rng(seed)
    light = np.sum([profile((40, 40), Drawn(u, v, 5000.0, 0.75, 0.75)) for u, v in places], axis=0)
    grains = random.gamma(SPECKLE**-2, SPECKLE**2, light.shape)
    frame = Sensor(10.0, 6.0, 8).expose(20.0 + light * grains, random)
    spots = find_spots(frame, expected=4).spots
    assert len(spots) == 4
    for spot, (u, v) in zip(spots, places, strict=True):
        assert spot.u_px == pytest.approx(u, abs=5 * spot.u_sd_px)
        assert spot.v_px == pytest.approx(v, abs=5 * spot.v_sd_px)


@pytest.mark.parametrize("share", [0.1, 0.05])
def test_a_clear_spot_on_dark_paper_is_not_dropped_for_its_neighbours(share: float) -> None:
    true = [Drawn(30.2 + 6.5 * n, 30.1, (1.0, share, 1.0, 1.0)[n] * 5e4, 0.85, 0.85) for n in range(4)]
    for seed in range(5):
        random = rng(seed)
        on, off = draw(true, random), draw([], random)
        spots = find_spots(on, off, scanlines=ROW, expected=4, saturation_dn=4095).spots
        assert [round(s.u_px) for s in spots] == [30, 37, 43, 50]


def test_neighbours_on_the_second_of_two_scanlines_are_both_found() -> None:
    true = [Drawn(20, 30), Drawn(30, 12), Drawn(30.2, 19), Drawn(45, 30)]
    lines = [Scanline(0, 30, 1, 0, 2), Scanline(30, 0, 0, 1, 2)]
    for order in (lines, lines[::-1]):
        spots = find_spots(draw(true, rng(), (60, 60)), scanlines=order, expected=4).spots
        assert sorted((round(s.u_px), round(s.v_px)) for s in spots) == [
            (20, 30),
            (30, 12),
            (30, 19),
            (45, 30),
        ]


def test_an_ellipse_is_not_split() -> None:
    frame = draw([Drawn(50, 30, 4e4, 2.6, 1.3)], rng(4), ambient=5.0)
    assert len(find_spots(frame, scanlines=ROW).spots) == 1
