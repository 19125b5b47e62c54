"""Corners of a plain chessboard in a frame."""

from __future__ import annotations

import cv2
import numpy as np

from workbench.corners.located import LocatedCorners, local_scale, stretched
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.known_board import Chessboard

NEIGHBOURS = 9
"""A corner and those around it."""
OPENCV_WINDOW_PX = 11
"""Half side of the window of OpenCV's refinement. Where squares are smaller it reaches the next corner."""
OPENCV_SD_PX = 0.1
"""Deviation of its positions, which it does not state; the fit scales it to the residuals."""


def find_chessboard(mean: FloatArray, board: Chessboard) -> LocatedCorners:
    """All inner corners of the board in a frame (height, width), or none: its detectors need the whole board.

    Half a turn of a board maps its corners to one another; which end is taken for the first does not matter.
    """
    image = stretched(mean)
    found, corners = cv2.findChessboardCorners(image, board.corners)
    if not found:  # the other detector tolerates more blur and noise, but misses small squares
        found, corners = cv2.findChessboardCornersSB(image, board.corners, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not found:
        corners = np.zeros((0, 2))
    position = np.asarray(corners, np.float64).reshape(-1, 2)
    ids = _right_handed(position, board) if found else np.array([], np.intp)
    at_mm = board.corners_mm[ids]
    return LocatedCorners(
        ids=ids,
        position_px=position,
        px_per_mm=local_scale(at_mm, at_mm, position, NEIGHBOURS),
        side_mm=board.square_mm,
        clear_mm=board.square_mm,
        found="all corners at once",
    )


def refine_as_opencv(mean: FloatArray, start_px: FloatArray) -> FloatArray:
    """(k, 2) positions of corners by OpenCV's `cornerSubPix`, with the window of its calibration programs."""
    until = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.001
    image, start = mean.astype(np.float32), start_px.astype(np.float32)
    found = cv2.cornerSubPix(image, start, (OPENCV_WINDOW_PX, OPENCV_WINDOW_PX), (-1, -1), until)
    return np.asarray(found, np.float64)


def _right_handed(position_px: FloatArray, board: Chessboard) -> IndexArray:
    """(k,) ids of the corners in the detector's order, of which some number the columns backwards."""
    columns, rows = board.corners
    ids = np.arange(columns * rows).reshape(rows, columns)
    grid = position_px.reshape(rows, columns, 2)
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    mirrored = across[0] * down[1] - across[1] * down[0] < 0
    return np.asarray((ids[:, ::-1] if mirrored else ids).ravel(), np.intp)
