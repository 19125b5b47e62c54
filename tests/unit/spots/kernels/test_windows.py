"""Windows, first guesses and marks against plain numpy."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.support.draw import Drawn, profile
from workbench.spots.kernels.columns import FLUX, LN_SU, LN_SV, U, V
from workbench.spots.kernels.windows import (
    HALVES_PX,
    cut_windows,
    exclude_light,
    flag_codes,
    half_for,
    halves_for,
    is_clipped,
    is_near_edge,
    mark_discs,
    mark_strip,
    moment_guess,
)


@pytest.mark.parametrize(
    ("width_px", "half_px"), [(0.5, 5), (1.5, 5), (1.51, 8), (2.5, 8), (2.51, 13), (6.16, 19), (50.0, 19)]
)
def test_a_window_reaches_three_widths_and_half_a_pixel(width_px: float, half_px: int) -> None:
    assert half_for(width_px) == half_px
    halves = np.empty(1, np.intp)
    halves_for(np.array([[0.0, 1.0, 0.0, 0.0, np.log(2 * width_px), 0.0]]), 0.5 * (1 - 1e-12), halves)
    assert halves[0] == half_px
    assert half_px == HALVES_PX[-1] or half_px >= 3 * width_px + 0.5


@pytest.mark.parametrize("seed", [1, 2])
def test_cut_windows_are_those_of_numpy(seed: int) -> None:
    """The last of three peaks is another window's neighbour alone."""
    rng = np.random.default_rng(seed)
    on = rng.integers(0, 256, (30, 40)).astype(np.uint8)
    off = rng.integers(0, 256, (30, 40)).astype(np.uint8)
    rows, cols, group = np.array([2.0, 20.0, 20.0]), np.array([37.0, 10.0, 16.0]), np.array([0, 1])
    data, clip = np.empty((2, 11, 11)), np.empty((2, 11, 11))
    usable = np.empty((2, 11, 11), bool)
    cut_windows(on, off, 0.7, 2.5, 240.0, rows, cols, group, data, usable, clip)
    for i in range(2):
        y, x = np.mgrid[-5:6, -5:6]
        row, col = (rows[i] + y).astype(int), (cols[i] + x).astype(int)
        inside = (row >= 0) & (row < 30) & (col >= 0) & (col < 40)
        here = np.clip(row, 0, 29), np.clip(col, 0, 39)
        np.testing.assert_allclose(data[i], on[here] - 0.7 * off[here] - 2.5, rtol=1e-12)
        own = np.hypot(row - rows[i], col - cols[i])
        others = [np.hypot(row - rows[k], col - cols[k]) for k in range(3) if k != i]
        np.testing.assert_array_equal(usable[i], inside & (on[here] < 240) & (own <= np.min(others, axis=0)))
        np.testing.assert_allclose(clip[i], data[i] + (240.0 - on[here]), rtol=1e-12)


def test_a_window_without_a_clipped_pixel_cannot_clip() -> None:
    on = np.full((20, 20), 100, np.uint8)
    data, usable, clip = np.empty((1, 11, 11)), np.empty((1, 11, 11), bool), np.empty((1, 11, 11))
    at = np.array([10.0])
    cut_windows(on, on, 0.0, 0.0, 255.0, at, at, np.array([0]), data, usable, clip)
    assert np.isinf(clip).all()


@pytest.mark.parametrize(("width_px", "tolerance"), [(0.7, 0.5), (1.3, 0.3), (2.0, 0.3)])
@pytest.mark.parametrize("offset_px", [0.0, 0.4])
def test_the_first_guess_is_near_the_spot(width_px: float, tolerance: float, offset_px: float) -> None:
    """Of the narrowest spots one or two pixels are above half the peak."""
    light = profile((17, 17), Drawn(8.0 + offset_px, 8.0 - offset_px, 1e4, width_px, width_px))
    usable = np.ones((1, 17, 17), bool)
    light[2, 2], usable[0, 2, 2] = 1e6, False
    start = np.empty((1, 6))
    moment_guess(light[None], usable, np.array([38.0]), np.array([58.0]), start)
    assert start[0, [U, V]] == pytest.approx([58.0 + offset_px, 38.0 - offset_px], abs=0.1)
    assert start[0, FLUX] == pytest.approx(1e4, rel=tolerance)
    assert np.exp(start[0, [LN_SU, LN_SV]]) == pytest.approx([width_px, width_px], rel=tolerance)


@pytest.mark.parametrize(
    ("u_px", "v_px", "near"),
    [(3.1, 20.0, False), (2.9, 20.0, True), (36.1, 20.0, True), (20.0, 4.9, True), (20.0, 24.1, True)],
)
def test_a_spot_is_near_the_edge_within_two_and_a_half_of_its_widths(
    u_px: float, v_px: float, near: bool
) -> None:
    params = np.array([0.0, 1e4, u_px, v_px, np.log(1.2), np.log(2.0)])
    assert is_near_edge(params, 30, 40) == near


@pytest.mark.parametrize(
    ("row", "col", "seen"), [(15, 22, True), (15, 23, False), (19, 20, True), (20, 20, False)]
)
def test_a_clipped_pixel_within_two_widths_counts(row: int, col: int, seen: bool) -> None:
    frame = np.zeros((30, 40), np.uint8)
    frame[row, col] = 255
    params = np.array([0.0, 1e4, 20.0, 15.0, np.log(1.0), np.log(2.0)])
    assert is_clipped(frame, 255.0, params) == seen
    codes = np.empty(1, np.intp)
    flag_codes(frame, 255.0, params[None], codes)
    assert codes[0] == 2 * seen


@pytest.mark.parametrize(
    ("u_px", "v_px", "code"),
    [(20.0, 15.0, 0), (33.0, 15.0, 0), (20.0, 27.5, 1), (37.5, 15.0, 1), (1.5, 15.0, 1), (20.0, 1.5, 1)],
)
@pytest.mark.parametrize("clipped", [False, True])
def test_codes_tell_the_border_from_clipping(u_px: float, v_px: float, code: int, clipped: bool) -> None:
    """In an image of 30 rows and 40 columns."""
    frame = np.zeros((30, 40), np.uint8)
    frame[round(v_px), round(u_px)] = 255 if clipped else 254
    codes = np.empty(1, np.intp)
    flag_codes(frame, 255.0, np.array([[0.0, 1e4, u_px, v_px, 0.0, 0.0]]), codes)
    assert codes[0] == code + 2 * clipped


def test_marks_of_discs_are_those_of_numpy() -> None:
    lights = np.array([[103.2, 55.1, 4.3], [96.0, 48.0, 2.0], [125.0, 60.0, 7.5], [300.0, 0.0, 5.0]])
    marked = np.zeros((20, 30), bool)
    mark_discs(45, 95, lights, marked)
    v, u = np.mgrid[45:65, 95:125]
    expected = np.any([np.hypot(u - a, v - b) < r for a, b, r in lights], axis=0)
    np.testing.assert_array_equal(marked, expected)


@pytest.mark.parametrize("masked", [False, True])
def test_marks_of_a_strip_are_those_of_numpy(masked: bool) -> None:
    rng = np.random.default_rng(3)
    mask = rng.random((12, 60)) < 0.5
    marked = np.zeros((20, 30), bool)
    mark_strip(45, 95, (40, 52), (80, 140), mask if masked else np.zeros((0, 0), bool), marked)
    image = np.zeros((200, 200), bool)
    image[40:52, 80:140] = mask if masked else True
    np.testing.assert_array_equal(marked, image[45:65, 95:125])


@pytest.mark.parametrize("seed", range(10))
def test_pixels_near_a_strip_and_without_other_light_are_used(seed: int) -> None:
    rng = np.random.default_rng(seed)
    allowed, usable = rng.random((31, 31)) < 0.02, rng.random((31, 31)) < 0.9
    lights = np.column_stack([rng.uniform(90, 130, 3), rng.uniform(40, 80, 3), rng.uniform(2, 6, 3)])
    lit = np.zeros((31, 31), bool)
    mark_discs(45, 95, lights, lit)
    near = cv2.dilate((allowed & ~lit).astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    expected = allowed & ~lit, usable & near & ~lit
    exclude_light(45, 95, lights, 4, allowed, usable)
    np.testing.assert_array_equal(allowed, expected[0])
    np.testing.assert_array_equal(usable, expected[1])
