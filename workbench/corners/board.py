"""Detection of a board: identity, position and standard deviation of its corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.corners.aprilgrid import find_aprilgrid
from workbench.corners.chessboard import OPENCV_SD_PX, find_chessboard, refine_as_opencv
from workbench.corners.located import LocatedCorners
from workbench.corners.markers import find_charuco
from workbench.corners.subpixel import fit_saddles
from workbench.model.arrays import FloatArray, Image, IndexArray
from workbench.model.errors import BadInputError
from workbench.model.known_board import FEWEST_CORNERS, AnyBoard, AprilGrid, Chessboard


@dataclass(frozen=True)
class BoardCorners:
    """The k corners of the board that were found."""

    ids: IndexArray
    """(k,) rows in the board's `corners_mm`."""
    position_px: FloatArray
    """(k, 2)"""
    sd_px: FloatArray
    """(k, 2) 1 sigma."""
    spoiled: int
    """Number of corners that were seen but could not be fitted: covered, or at the frame's border."""


def find_board(frames: Sequence[Image], board: AnyBoard) -> BoardCorners:
    """Find the board in the mean of frames (height, width) of a static scene.

    Raises:
        BadInputError: no frames, frames of different sizes, or fewer than FEWEST_CORNERS corners.
    """
    if not frames:
        raise BadInputError("expected at least one frame of the board, got none")
    if len({frame.shape for frame in frames}) > 1:
        raise BadInputError("expected frames of the board of one size")
    mean = np.mean([frame.astype(np.float64) for frame in frames], axis=0)
    located = _locate(mean, board)
    if len(located.ids) < FEWEST_CORNERS:
        raise BadInputError(
            f"expected at least {FEWEST_CORNERS} corners of the board, got {len(located.ids)} (from"
            f" {located.found}); {_remedy(board)}"
        )
    if isinstance(board, Chessboard) and board.refine == "opencv":
        position = refine_as_opencv(mean, located.position_px)
        return BoardCorners(located.ids, position, np.full_like(position, OPENCV_SD_PX), 0)
    fitted = fit_saddles(mean, located.position_px, located.px_per_mm, located.side_mm, located.clear_mm)
    good = fitted.good
    if int(good.sum()) < FEWEST_CORNERS:
        raise BadInputError(
            f"expected at least {FEWEST_CORNERS} clear corners of the board, got {int(good.sum())} of"
            f" {len(good)} located; check its distance, focus, and even lighting"
        )
    return BoardCorners(located.ids[good], fitted.position_px[good], fitted.sd_px[good], int((~good).sum()))


def _locate(mean: FloatArray, board: AnyBoard) -> LocatedCorners:
    """Corners to a pixel, by the detector of the board's kind."""
    if isinstance(board, Chessboard):
        return find_chessboard(mean, board)
    if isinstance(board, AprilGrid):
        return find_aprilgrid(mean, board)
    return find_charuco(mean, board)


def _remedy(board: AnyBoard) -> str:
    if isinstance(board, Chessboard):
        return "show the whole board with a white margin, in even light, and check board.corners"
    return "use more light, a nearer board, or show a larger part of the board"
