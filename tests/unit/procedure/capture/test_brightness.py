"""Brightness of what the lasers light, among noise, lamps and hot pixels."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.model.arrays import Image
from workbench.procedure.capture.brightness import Brightness, measure_brightness

FULL = 255
EVERYWHERE = np.ones((20, 30), np.bool_)


def frames(seed: int, spot_dn: int, noise_dn: float = 1.5) -> tuple[list[Image], list[Image]]:
    """Two lit frames with a spot at row 10, column 11, and two dark ones."""
    rng = np.random.default_rng(seed)
    made = np.rint(7 + noise_dn * rng.standard_normal((4, *EVERYWHERE.shape))).clip(0, 255).astype(np.uint8)
    made[:2, 10, 11] = np.minimum(made[:2, 10, 11] + spot_dn, 255)
    return [made[0], made[1]], [made[2], made[3]]


@pytest.mark.parametrize("seed", range(5))
def test_the_brightest_lit_pixel_and_its_share(seed: int) -> None:
    on, off = frames(seed, 90)
    seen = measure_brightness(on, off, EVERYWHERE, FULL)
    assert seen.peak == max(image[10, 11] for image in on) / FULL
    assert seen.lit == pytest.approx(90 / FULL, abs=3 * 1.5 / FULL)
    assert seen.noise == pytest.approx(1.5 * 2**0.5 / FULL, rel=0.15)


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_no_spot(seed: int) -> None:
    on, off = frames(seed, 0)
    assert measure_brightness(on, off, EVERYWHERE, FULL) == Brightness(7 / FULL)


def test_a_room_that_clips_is_not_dark() -> None:
    white = np.full((20, 30), 255, np.uint8)
    assert measure_brightness([white, white], [white, white], EVERYWHERE, FULL) == Brightness(1.0)


def test_a_hot_pixel_or_a_steady_lamp_is_not_the_spot() -> None:
    on, off = frames(1, 90)
    for image in (*on, *off):
        image[3, 4] = 255
    assert measure_brightness(on, off, EVERYWHERE, FULL).peak < 0.5


def flickering(seed: int, depth_dn: float) -> tuple[list[Image], list[Image]]:
    """As `frames`, with a lamp of 5 x 5 pixels whose brightness in each frame is that of a random phase."""
    on, off = frames(seed, 60)
    phases = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi, 4)
    for image, phase in zip((*on, *off), phases, strict=True):
        image[1:6, 20:25] = round(120 + depth_dn * np.cos(phase))
    return on, off


def test_a_lamp_beside_the_scanlines_is_not_looked_at() -> None:
    """However it flickers: its rows are none of the laser's."""
    rows = np.zeros_like(EVERYWHERE)
    rows[8:13] = True
    for seed in range(50):
        assert measure_brightness(*flickering(seed, 100), rows, FULL).peak == pytest.approx(
            67 / FULL, abs=0.03
        )


def test_a_lamp_that_flickers_among_the_spots_is_seldom_taken_for_one() -> None:
    """Brighter than the spot by far, and its flicker too. Of four random phases both lit ones are the highest
    once in six; differing from frame to frame rules out nearly all of these.
    """
    misled = sum(
        measure_brightness(*flickering(seed, 100), EVERYWHERE, FULL).peak > 0.32 for seed in range(400)
    )
    by_chance = sum(
        float(on[0][3, 22]) - float(off[1][3, 22]) > 67
        for on, off in (flickering(s, 100) for s in range(400))
    )
    print(f"misled {misled} of 400, by one frame each {by_chance}")
    assert by_chance > 60
    assert misled < by_chance / 6
