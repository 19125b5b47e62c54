"""The board's description against OpenCV's own ChArUco boards."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from workbench.model.board import Board, sag_mm

SCALE = 4
"""Pixels to a millimetre: cells of the default board's markers are 2.5 mm wide."""


@pytest.mark.parametrize("block", [0, 1])
def test_corners_and_print_are_opencv_s(block: int) -> None:
    board = Board()
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    ids = np.arange(board.markers) + block * board.markers
    theirs = cv2.aruco.CharucoBoard((13, 4), 20.0, 15.0, dictionary, ids)
    place = np.array([board.left_mm, board.block_tops_mm[block]])

    mine = board.corners_mm[block * board.corners_per_block :][: board.corners_per_block]
    np.testing.assert_allclose(mine, np.array(theirs.getChessboardCorners())[:, :2] + place, atol=1e-4)

    drawn = theirs.generateImage((13 * 20 * SCALE, 4 * 20 * SCALE))
    printed = np.full_like(drawn, 255)
    for left, top, width, height in board.black_mm() - [*place, 0, 0]:
        if 0 <= top < 4 * 20:
            x0, y0, x1, y1 = (round(SCALE * edge) for edge in (left, top, left + width, top + height))
            printed[y0:y1, x0:x1] = 0
    np.testing.assert_array_equal(printed, drawn)


def test_the_band_is_blank_and_the_origin_in_its_middle() -> None:
    board = Board(band_mm=30.0, columns=11, rows=3)
    left, top, width, height = board.black_mm().T
    assert (left.min(), (left + width).max()) == (-110.0, 110.0)
    assert (top.min(), (top + height).max()) == (-75.0, 75.0)
    assert ((top >= 15.0) | (top + height <= -15.0)).all()


def test_a_board_may_use_every_marker_of_its_dictionary() -> None:
    board = Board(square_mm=10.0, marker_mm=7.0, columns=25, rows=4)
    assert 2 * board.markers == 100


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"marker_mm": 20.0}, "marker_mm smaller than square_mm"),
        ({"band_mm": 25.0}, "within 287 x 184 mm of the page, got 260 x 185"),
        ({"square_mm": 10.0, "marker_mm": 7.0, "columns": 28}, "at most 100 markers"),
    ],
)
def test_boards_that_cannot_be(change: dict[str, float], reason: str) -> None:
    with pytest.raises(ValidationError, match=reason):
        Board.model_validate(change)


def test_the_sag_is_what_was_stated_at_100_mm() -> None:
    points = np.array([[100.0, 0.0], [0.0, -100.0], [100.0, 100.0], [0.0, 0.0]])
    np.testing.assert_allclose(sag_mm(np.array([0.1, 0.02, 0.003]), points), [0.1, 0.02, 0.123, 0.0])
