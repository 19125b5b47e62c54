"""The search: order of spots, impostors, failures by name."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw, profile
from workbench.spots import Failure, Scanline, find_spots

ROW = [Scanline(0, 30, 1, 0, 3)]
SENSOR_8_BIT = Sensor(bits=8)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("line", "middle"),
    [
        (Scanline(0, 30, 1, 0, 2), (30.0, 30.0)),
        (Scanline(0, 30, -1, 0, 2), (30.0, 30.0)),
        (Scanline(30, 0, 0, 1, 2), (30.0, 30.0)),
        (Scanline(0, 0, 1, 1, 2), (30.0, 30.0)),
        (Scanline(0, 59, 2, -2, 2), (30.0, 29.0)),
        (Scanline(0, 20, 3, 1, 2), (30.0, 30.0)),
    ],
)
def test_spots_on_a_line_come_in_its_order(line: Scanline, middle: tuple[float, float]) -> None:
    along = np.array([line.du, line.dv]) / np.hypot(line.du, line.dv)
    places = [np.array(middle) + t * along for t in (-16.0, 0.3, 15.0)]
    frame = draw([Drawn(float(u), float(v)) for u, v in places], rng(), (60, 60))
    spots = find_spots(frame, scanlines=[line], expected=3).spots
    np.testing.assert_allclose([(s.u_px, s.v_px) for s in spots], places, atol=0.1)


def test_two_scanlines_at_once() -> None:
    frame = draw([Drawn(15, 30), Drawn(45, 30), Drawn(30, 12)], rng(), (60, 60))
    lines = [Scanline(0, 30, 1, 0, 2), Scanline(30, 0, 0, 1, 2)]
    assert [round(s.u_px) for s in find_spots(frame, scanlines=lines, expected=3).spots] == [15, 30, 45]


def test_hot_pixels_and_reflections_are_no_spots() -> None:
    frame = draw([Drawn(40, 30), Drawn(80, 14)], rng()).copy()
    frame[30, 60] = frame[29, 90] = 3000
    finding = find_spots(frame, scanlines=ROW)
    assert [round(s.u_px) for s in finding.spots] == [40]


def test_a_hot_pixel_inside_a_spot_does_not_move_it() -> None:
    frame = draw([Drawn(40.2, 30, 5e4, 2.0, 2.0)], rng()).copy()
    frame[31, 43] += 1500
    (spot,) = find_spots(frame, scanlines=ROW).spots
    assert spot.u_px == pytest.approx(40.2, abs=5 * spot.u_sd_px)


NOISE = draw([], rng(8))


PROVOKED = [
    (Failure.NO_SPOT, NOISE, 1),
    (Failure.TOO_FEW, draw([Drawn(40, 30)], rng(8)), 2),
    (Failure.TOO_MANY, draw([Drawn(30, 30), Drawn(60, 30)], rng(8)), 1),
    (Failure.TOO_DIM, draw([Drawn(60, 30, 190.0)], rng(11)), 1),
    (Failure.SATURATED, draw([Drawn(60, 30, 4e6)], rng(8)), 1),
    (Failure.OFF_SCANLINE, draw([Drawn(60, 12)], rng(8)), 1),
    (Failure.MERGED, draw([Drawn(60, 30, 5e4), Drawn(63, 30, 5e4)], rng(8)), 2),
    (Failure.AT_EDGE, draw([Drawn(1.0, 30)], rng(8)), 1),
]


@pytest.mark.parametrize(("failure", "frame", "expected"), PROVOKED, ids=[p[0].value for p in PROVOKED])
def test_each_failure_is_named(failure: Failure, frame: np.ndarray, expected: int) -> None:
    assert failure in find_spots(frame, scanlines=ROW, expected=expected).failures


def test_a_spot_at_the_edge_is_honest() -> None:
    z = []
    for seed in range(40):
        (spot,) = find_spots(
            draw([Drawn(0.4, 30, 3e4)], rng(seed), ambient=5.0), scanlines=ROW, expected=1
        ).spots
        assert Failure.AT_EDGE in spot.flags
        z.append((spot.u_px - 0.4) / spot.u_sd_px)
    assert np.std(z) == pytest.approx(1.0, abs=0.05 + 4 / np.sqrt(80))


@pytest.mark.parametrize("width_px", [0.95, 1.5])
def test_a_spot_clipped_two_hundred_times_over_is_found_and_called_saturated(width_px: float) -> None:
    """With speckle, whose contrast leaves its flux uncertain: only the rim is below full scale."""
    grains, contrast = rng(3), 0.167
    electrons = SENSOR_8_BIT.electrons_per_dn * 200 * 255 * 2 * np.pi * width_px**2
    for seed in range(20):
        light = profile((60, 90), Drawn(45.3, 30.2, electrons, width_px, width_px))
        light *= grains.gamma(contrast**-2, contrast**2, light.shape)
        frames = [SENSOR_8_BIT.expose(each, rng(seed)) for each in (light, np.zeros_like(light))]
        finding = find_spots(*frames, scanlines=ROW, expected=1, speckle_sd_px=0.037)
        (spot,) = finding.spots
        assert abs(spot.u_px - 45.3) < 0.3
        assert Failure.SATURATED in spot.flags
