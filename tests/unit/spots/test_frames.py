"""Frames that are refused, and their full scale."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.model.errors import BadInputError
from workbench.spots import find_spots
from workbench.spots.frames import check_pair, default_saturation_dn


@pytest.mark.parametrize(
    ("on", "off", "words"),
    [
        (np.zeros((4, 4, 3), np.uint8), None, "colour"),
        (np.zeros((4, 4)), None, "float64"),
        ([[1, 2]], None, "list"),
        (np.zeros((0, 4), np.uint8), None, "no pixel"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 5), np.uint8), "size and depth"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 4), np.uint16), "size and depth"),
    ],
)
def test_bad_input_is_refused_in_words(on: np.ndarray, off: np.ndarray | None, words: str) -> None:
    with pytest.raises(BadInputError, match=words):
        find_spots(on, off)


@pytest.mark.parametrize(
    ("brightest", "full_scale"),
    [(0, 1023), (1023, 1023), (1024, 4095), (4095, 4095), (4096, 16383), (16384, 65535), (65535, 65535)],
)
def test_a_frame_of_16_bits_clips_at_the_smallest_full_scale_that_holds_it(
    brightest: int, full_scale: int
) -> None:
    frame = np.zeros((3, 4), np.uint16)
    frame[1, 2] = brightest
    assert default_saturation_dn(frame) == full_scale
    assert default_saturation_dn(np.full((3, 4), 7, np.uint8)) == 255


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 15])
def test_left_aligned_frames_clip_at_their_full_scale(bits: int) -> None:
    step = 2 ** (16 - bits)
    frame = np.full((3, 4), 5 * step, np.uint16)
    frame[1, 2] = 2**16 - step
    assert default_saturation_dn(frame) == 2**16 - step
    frame[0, 0] += 1
    assert default_saturation_dn(frame) == 2**16 - 1


def test_stated_bits_decide_where_the_brightest_pixel_could_mislead() -> None:
    frame = np.full((3, 4), 4095, np.uint16)
    assert default_saturation_dn(frame, 16) == 2**16 - 1
    assert default_saturation_dn(frame, 14) == 2**14 - 1
    assert default_saturation_dn(16 * frame, 12) == 16 * 4095


def test_good_frames_come_back_as_they_are() -> None:
    on, off = np.zeros((3, 4), np.uint8), np.ones((3, 4), np.uint8)
    assert check_pair(on, off)[0] is on
    assert check_pair(on, off)[1] is off
    assert check_pair(on, None) == (on, None)
