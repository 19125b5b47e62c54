"""ArUco markers in a frame, and the chessboard corners between those of ChArUco blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from workbench.corners.located import LocatedCorners, as_ids, local_scale, stretched
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.board import Board
from workbench.model.known_board import CharucoBoard

ENLARGED = 2
"""Factor by which the frame is enlarged for the marker detection; a marker's cell needs some four pixels."""
MOST_ENLARGED_PX = 2**23
"""Largest frame that is enlarged: markers in larger ones have enough pixels."""


@dataclass(frozen=True)
class Markers:
    """The m detected markers of a dictionary, each once."""

    ids: IndexArray
    corners_px: FloatArray
    """(m, 4, 2) clockwise, from the marker's own top left corner."""


@dataclass(frozen=True)
class _Block:
    """A chessboard of squares with markers on a board."""

    board: cv2.aruco.CharucoBoard
    place_mm: FloatArray
    """(2,) position of its top left corner on the board."""
    first_marker: int
    markers: int
    corners: int

    @property
    def marker_corners_mm(self) -> FloatArray:
        """(markers, 4, 2) nominal corners of the markers, clockwise from their top left."""
        return np.asarray(np.array(self.board.getObjPoints(), np.float64)[:, :, :2] + self.place_mm)

    def has(self, ids: IndexArray) -> IndexArray:
        """Indices of the markers of this block."""
        return np.flatnonzero((ids >= self.first_marker) & (ids < self.first_marker + self.markers))


def find_markers(mean: FloatArray, dictionary: str, border_bits: int = 1) -> Markers:
    """Markers in a frame (height, width), without those seen more than once."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border_bits
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    detector = cv2.aruco.ArucoDetector(known, parameters)
    factor = ENLARGED if mean.size <= MOST_ENLARGED_PX else 1
    image = stretched(mean)
    if factor > 1:
        enlarged = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
        image = np.asarray(enlarged, np.uint8)
    found, found_ids, _ = detector.detectMarkers(image)
    ids = as_ids(found_ids)
    corners = np.array(found, np.float64).reshape(-1, 4, 2)
    once = np.bincount(ids, minlength=1)[ids] == 1
    return Markers(ids[once], (corners[once] + 0.5) / factor - 0.5)


def find_charuco(mean: FloatArray, board: Board | CharucoBoard) -> LocatedCorners:
    """Corners of the blocks of a board, between its markers, in a frame (height, width)."""
    seen = find_markers(mean, board.dictionary)
    image = stretched(mean)
    ids, positions = [np.array([], np.intp)], [np.zeros((0, 2))]
    points_mm, points_px = [np.zeros((0, 2))], [np.zeros((0, 2))]
    first, count = 0, 0
    for block in _blocks(board):
        own = block.has(seen.ids)
        count += len(own)
        if len(own):
            numbers, places = _corners_of(image, block, seen, own)
            ids.append(numbers + first)
            positions.append(places)
            of_board = block.marker_corners_mm[seen.ids[own] - block.first_marker]
            points_mm.append(of_board.reshape(-1, 2))
            points_px.append(seen.corners_px[own].reshape(-1, 2))
        first += block.corners
    numbers = np.concatenate(ids)
    at_mm = board.corners_mm[numbers]
    return LocatedCorners(
        ids=numbers,
        position_px=np.concatenate(positions),
        px_per_mm=local_scale(at_mm, np.concatenate(points_mm), np.concatenate(points_px)),
        side_mm=board.square_mm,
        clear_mm=(board.square_mm - board.marker_mm) / 2,
        found=f"{count} of its markers",
    )


def _corners_of(
    image: np.ndarray, block: _Block, seen: Markers, own: IndexArray
) -> tuple[IndexArray, FloatArray]:
    """Ids (k,) within the block, and positions (k, 2) to a pixel, of the corners between its markers."""
    detector = cv2.aruco.CharucoDetector(block.board)
    corners = tuple(seen.corners_px[own].astype(np.float32)[:, None])
    found, found_ids, _, _ = detector.detectBoard(
        image, markerCorners=corners, markerIds=seen.ids[own].astype(np.int32)[:, None]
    )
    ids = as_ids(found_ids)
    return ids, np.asarray(found, np.float64).reshape(-1, 2) if len(ids) else np.zeros((0, 2))


def _blocks(board: Board | CharucoBoard) -> Sequence[_Block]:
    if isinstance(board, CharucoBoard):
        columns, rows = board.squares
        place = -np.array([columns, rows]) * board.square_mm / 2
        whole = _block((columns, rows), board, board.first_marker, place, board.legacy_pattern)
        return (whole,)
    return [
        _block((board.columns, board.rows), board, number * board.markers, np.array([board.left_mm, top]))
        for number, top in enumerate(board.block_tops_mm)
    ]


def _block(
    squares: tuple[int, int],
    board: Board | CharucoBoard,
    first_marker: int,
    place_mm: FloatArray,
    legacy: bool = False,
) -> _Block:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    markers = squares[0] * squares[1] // 2
    ids = np.arange(markers) + first_marker
    charuco = cv2.aruco.CharucoBoard(squares, board.square_mm, board.marker_mm, dictionary, ids)
    charuco.setLegacyPattern(legacy)
    return _Block(charuco, place_mm, first_marker, markers, (squares[0] - 1) * (squares[1] - 1))
