"""Dark frames: noise looks like a spot now and then, and must not pass for a beam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from workbench.spots import Scanline, Spot, find_spots, is_same_spot, persistent_spots
from workbench.spots.persistence import SIGNIFICANT, significance

SENSOR = Sensor(electrons_per_dn=156.0, read_sd=225.0, bits=8)
EVERYWHERE = [Scanline(0.0, 239.5, 1.0, 0.0, 240.0)]
FRAMES = 300


def dark(rng: np.random.Generator, spots: list[Drawn]) -> np.ndarray:
    return draw(spots, rng, (480, 640), SENSOR)


@pytest.mark.thorough
def test_noise_is_taken_for_a_spot_now_and_then_and_never_for_a_light() -> None:
    rng = np.random.default_rng(1)
    spots, lights = 0, 0
    for _ in range(FRAMES):
        found = find_spots(dark(rng, []), scanlines=EVERYWHERE).spots
        spots += bool(found)
        assert all(significance(spot) < SIGNIFICANT for spot in found)
        lights += bool(persistent_spots(found, lambda: find_spots(dark(rng, []), scanlines=EVERYWHERE).spots))
    print(f"spots in {spots} of {FRAMES} dark frames")
    assert spots > 0, "otherwise nothing is tested"
    assert lights == 0


@pytest.mark.parametrize(("electrons", "looks"), [(1.0e4, 1), (4e4, 0)])
def test_a_beam_is_a_light_be_it_faint(electrons: float, looks: int) -> None:
    """Six standard deviations, which noise does not reach twice at one place; and more than twenty.

    One look finds the faint one in 495 of 500 frames: both looks in 49 of 50, with an sd of 1.
    """
    rng = np.random.default_rng(2)
    beam, seen, looked = Drawn(200.3, 300.4, electrons), 0, 0

    def find_again() -> tuple[Spot, ...]:
        nonlocal looked
        looked += 1
        return find_spots(dark(rng, [beam]), scanlines=EVERYWHERE).spots

    for _ in range(50):
        lights = persistent_spots(find_spots(dark(rng, [beam]), scanlines=EVERYWHERE).spots, find_again)
        seen += any(abs(light.u_px - beam.u) < 2 and abs(light.v_px - beam.v) < 2 for light in lights)
    assert seen >= 50 - 1 - 4
    assert looked / 50 == pytest.approx(looks, abs=0.1)


def test_the_clear_ones_need_no_second_look() -> None:
    rng = np.random.default_rng(3)
    frame = dark(rng, [Drawn(100.0, 100.0, 1e5), Drawn(400.0, 300.0, 1e5)])
    lights = persistent_spots(
        find_spots(frame, scanlines=EVERYWHERE).spots, lambda: pytest.fail("not asked for")
    )
    assert len(lights) == 2
    assert not is_same_spot(*lights)


@pytest.mark.parametrize("angle", [0.0, 0.9, np.pi / 2])
@pytest.mark.parametrize(("sd_px", "limit_px"), [(0.0, 3.0), (0.5, 7.0)])
def test_one_spot_lies_within_three_pixels_and_four_deviations(
    angle: float, sd_px: float, limit_px: float
) -> None:
    """The deviations of both positions add up in squares: four of half a pixel are one pixel."""
    spot = Spot(100.0, 80.0, sd_px, sd_px, flux_dn=1e3, width_px=1.3, peak_dn=90.0)
    for distance_px, same in ((0.98 * limit_px, True), (1.02 * limit_px, False)):
        u_px, v_px = 100.0 + distance_px * np.cos(angle), 80.0 + distance_px * np.sin(angle)
        assert is_same_spot(spot, replace(spot, u_px=u_px, v_px=v_px)) == same


def test_a_faint_one_beside_a_clear_one_is_a_light_as_well() -> None:
    """Of the lamps that burn before anything is fired none may be forgotten."""
    rng = np.random.default_rng(4)
    lamps = [Drawn(100.0, 100.0, 1e5), Drawn(400.0, 300.0, 1.0e4)]
    found, again = (find_spots(dark(rng, lamps), scanlines=EVERYWHERE).spots for _ in range(2))
    clear, faint = sorted(found, key=significance, reverse=True)
    assert significance(faint) < SIGNIFICANT < significance(clear)
    assert persistent_spots(found, lambda: again) == list(found)
    assert persistent_spots(found, list) == [clear]
