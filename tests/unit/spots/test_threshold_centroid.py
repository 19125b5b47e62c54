"""The chain of threshold, scanline and centroid."""

from __future__ import annotations

import numpy as np

from tests.support.draw import Drawn, Sensor, draw
from workbench.spots import Scanline
from workbench.spots.threshold_centroid import thesis_centres

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_the_chain_of_the_thesis_finds_the_same_spots_less_exactly() -> None:
    sensor = Sensor(electrons_per_dn=20.0, bits=8)
    true = [Drawn(30.4, 30.2, 3e4), Drawn(80.1, 29.9, 3e4)]
    on, off = draw(true, rng(1), sensor=sensor), draw([], rng(2), sensor=sensor)
    centres = thesis_centres(on, off, scanlines=ROW, expected=2)
    assert sorted(np.round(centres[:, 0])) == [30, 80]


def test_centres_of_mass_come_brightest_first() -> None:
    frame = np.zeros((30, 60), np.uint8)
    frame[10:13, 20:23] = 100
    frame[20, 40:44] = 200
    centres = thesis_centres(frame, expected=2)
    np.testing.assert_allclose(centres, [[21.0, 11.0], [41.5, 20.0]])


def test_the_threshold_falls_until_as_many_are_seen_as_expected() -> None:
    frame = np.zeros((30, 60), np.uint8)
    frame[10, 20], frame[20, 40] = 100, 15
    assert len(thesis_centres(frame, expected=1)) == 1
    np.testing.assert_allclose(thesis_centres(frame, expected=2), [[20.0, 10.0], [40.0, 20.0]])
    assert len(thesis_centres(np.zeros((30, 60), np.uint8), expected=1)) == 0


def test_where_two_scanlines_meet_nothing_counts() -> None:
    frame = np.zeros((60, 60), np.uint8)
    frame[30, 30] = frame[30, 50] = 100
    lines = [Scanline(0, 30, 1, 0, 3), Scanline(30, 0, 0, 1, 3)]
    assert len(thesis_centres(frame, scanlines=lines, expected=2)) == 2
    np.testing.assert_allclose(
        thesis_centres(frame, scanlines=lines, expected=2, ambiguous_px=5.0), [[50.0, 30.0]]
    )
