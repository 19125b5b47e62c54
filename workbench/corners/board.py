"""Detection of the printed board: identity, position and standard deviation of its corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.corners.subpixel import fit_saddles
from workbench.model.arrays import FloatArray, Image, IndexArray
from workbench.model.board import Board
from workbench.model.errors import BadInputError

FEWEST_CORNERS = 12
"""Least number of corners: a pose has six unknowns, so that one bad corner is redundant."""
ENLARGED = 2
"""Factor by which the frame is enlarged for the marker detection; a marker's cell needs some four pixels."""
NEIGHBOURS = 8
"""Marker corners for the local scale at a board corner: those of the two markers that touch it."""


@dataclass(frozen=True)
class BoardCorners:
    """The k corners of the board that were found."""

    ids: IndexArray
    """(k,) rows in `Board.corners_mm`."""
    position_px: FloatArray
    """(k, 2)"""
    sd_px: FloatArray
    """(k, 2) 1 sigma."""
    spoiled: int
    """Number of corners that were seen but could not be fitted: covered, or at the frame's border."""


def find_board(frames: Sequence[Image], board: Board) -> BoardCorners:
    """Find the board in the mean of frames (height, width) of a static scene.

    Raises:
        BadInputError: no frames, frames of different sizes, or fewer than FEWEST_CORNERS corners.
    """
    if not frames:
        raise BadInputError("expected at least one frame of the board, got none")
    if len({frame.shape for frame in frames}) > 1:
        raise BadInputError("expected frames of the board of one size")
    mean = np.mean([frame.astype(np.float64) for frame in frames], axis=0)
    markers = _markers(mean, board)
    ids, start_px = _corners(mean, board, markers)
    if len(ids) < FEWEST_CORNERS:
        raise BadInputError(
            f"expected at least {FEWEST_CORNERS} corners of the board, got {len(ids)} (from"
            f" {len(markers.ids)} of its markers); use more light, a nearer board, or show"
            " a larger part of the board"
        )
    px_per_mm = _px_per_mm(board.corners_mm[ids], markers)
    fitted = fit_saddles(mean, start_px, px_per_mm, board.square_mm, (board.square_mm - board.marker_mm) / 2)
    good = fitted.good
    if int(good.sum()) < FEWEST_CORNERS:
        raise BadInputError(
            f"expected at least {FEWEST_CORNERS} clear corners of the board, got {int(good.sum())} of"
            f" {len(ids)} located by its markers; check its distance, focus, and even lighting"
        )
    return BoardCorners(ids[good], fitted.position_px[good], fitted.sd_px[good], int((~good).sum()))


@dataclass(frozen=True)
class _Markers:
    """The m detected markers of the board."""

    ids: IndexArray
    corners_px: FloatArray
    """(m, 4, 2)"""
    corners_mm: FloatArray
    """(m, 4, 2)"""


def _markers(mean: FloatArray, board: Board) -> _Markers:
    dictionary = _dictionary(board)
    detector = cv2.aruco.ArucoDetector(dictionary)
    enlarged = cv2.resize(_stretched(mean), None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC)
    found, found_ids, _ = detector.detectMarkers(enlarged)
    nominal = np.concatenate([_marker_corners_mm(board, block) for block in (0, 1)])
    ids = _ids(found_ids)
    corners = np.array(found, np.float64).reshape(-1, 4, 2)
    known = (ids < len(nominal)) & (np.bincount(ids, minlength=1)[ids] == 1)
    return _Markers(ids[known], (corners[known] + 0.5) / ENLARGED - 0.5, nominal[ids[known]])


def _corners(mean: FloatArray, board: Board, markers: _Markers) -> tuple[IndexArray, FloatArray]:
    """Ids (k,) and positions (k, 2), to a pixel, of the corners between detected markers."""
    image = _stretched(mean)
    ids, positions = [np.array([], np.intp)], [np.zeros((0, 2))]
    for block in (0, 1):
        own = markers.ids // board.markers == block
        if not own.any():
            continue
        detector = cv2.aruco.CharucoDetector(_charuco(board, block))
        corners = tuple(markers.corners_px[own].astype(np.float32)[:, None])
        marker_ids = markers.ids[own].astype(np.int32)[:, None]
        found, found_ids, _, _ = detector.detectBoard(image, markerCorners=corners, markerIds=marker_ids)
        if numbers := _ids(found_ids).tolist():
            ids.append(np.array(numbers, np.intp) + block * board.corners_per_block)
            positions.append(np.asarray(found, np.float64).reshape(-1, 2))
    return np.concatenate(ids), np.concatenate(positions)


def _px_per_mm(corners_mm: FloatArray, markers: _Markers) -> FloatArray:
    """(k, 2, 2) derivatives of the pixel position by the board's x, y at its corners, from markers nearby."""
    points_mm, points_px = markers.corners_mm.reshape(-1, 2), markers.corners_px.reshape(-1, 2)
    matrices = []
    for corner in corners_mm:
        near = np.argsort(((points_mm - corner) ** 2).sum(axis=1))[:NEIGHBOURS]
        design = np.column_stack([points_mm[near] - corner, np.ones(len(near))])
        matrices.append(np.linalg.lstsq(design, points_px[near], rcond=None)[0][:2].T)
    return np.array(matrices)


def _stretched(mean: FloatArray) -> NDArray[np.uint8]:
    """The frame with its contrast stretched to 8 bits; in room light the board may span a few levels only."""
    dark, bright = np.percentile(mean, (1, 99))
    return np.asarray(np.clip((mean - dark) / max(bright - dark, 1e-9) * 255, 0, 255), np.uint8)


def _ids(found: object) -> IndexArray:
    """Ids as an array; OpenCV returns None for no ids."""
    return np.array([], np.intp) if found is None else np.asarray(found, np.intp).ravel()


def _dictionary(board: Board) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))


def _charuco(board: Board, block: int) -> cv2.aruco.CharucoBoard:
    ids = np.arange(board.markers) + block * board.markers
    size = (board.columns, board.rows)
    return cv2.aruco.CharucoBoard(size, board.square_mm, board.marker_mm, _dictionary(board), ids)


def _marker_corners_mm(board: Board, block: int) -> FloatArray:
    """(markers, 4, 2) nominal corners of a block's markers, mm, clockwise from their top left."""
    corners = np.array(_charuco(board, block).getObjPoints(), np.float64)[:, :, :2]
    return np.asarray(corners + np.array([board.left_mm, board.block_tops_mm[block]]), np.float64)
