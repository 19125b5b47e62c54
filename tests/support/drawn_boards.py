"""Pictures of calibration boards, drawn from OpenCV's markers and a homography."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.model.arrays import FloatArray, Image
from workbench.model.known_board import AprilGrid, CharucoBoard, Chessboard

KnownBoard = Chessboard | CharucoBoard | AprilGrid
SCALE = 10
"""Pixels of the print to a millimetre."""
SUBPIXELS = 4
BLUR_PX = 0.6
PAPER, INK = 200.0, 30.0
SIZE_PX = (640, 480)
VIEWS = (((80, 20), (600, 90), (560, 450), (40, 400)), ((120, 30), (600, 110), (500, 460), (50, 380)))
"""Corners of the print in the picture, clockwise from the top left. No edge is along an axis of the image."""


def print_of(board: KnownBoard, from_top: bool) -> tuple[NDArray[np.uint8], FloatArray]:
    """The print, 0 or 255, and the place (x, y) of its top left corner on the board, mm."""
    if isinstance(board, AprilGrid):
        return _aprilgrid(board, from_top)
    if isinstance(board, Chessboard):
        columns, rows = board.corners[0] + 1, board.corners[1] + 1
        squares = np.indices((rows, columns)).sum(axis=0) % 2 * 255
        drawn = np.kron(squares, np.ones((round(board.square_mm * SCALE),) * 2)).astype(np.uint8)
    else:
        columns, rows = board.squares
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        ids = np.arange(columns * rows // 2) + board.first_marker
        theirs = cv2.aruco.CharucoBoard((columns, rows), board.square_mm, board.marker_mm, dictionary, ids)
        theirs.setLegacyPattern(board.legacy_pattern)
        side = round(board.square_mm * SCALE)
        drawn = np.asarray(theirs.generateImage((columns * side, rows * side)), np.uint8)
    return drawn, -np.array([columns, rows]) * board.square_mm / 2


def _aprilgrid(board: AprilGrid, from_top: bool) -> tuple[NDArray[np.uint8], FloatArray]:
    """Kalibr's print: tags numbered from the bottom row (or the top row), small squares at their corners."""
    columns, rows = board.tags
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    cells = dictionary.markerSize + 2 * board.border_bits
    side, gap = round(board.tag_mm * SCALE), round(board.gap_mm * SCALE)
    pitch = side + gap
    drawn = np.full((rows * pitch + gap, columns * pitch + gap), 255, np.uint8)
    for row in range(rows + 1):
        for column in range(columns + 1):
            drawn[row * pitch : row * pitch + gap, column * pitch : column * pitch + gap] = 0
    for row in range(rows):
        for column in range(columns):
            number = board.first_tag + (row if from_top else rows - 1 - row) * columns + column
            tag = dictionary.generateImageMarker(number, cells, borderBits=board.border_bits)
            there = (
                slice(row * pitch + gap, (row + 1) * pitch),
                slice(column * pitch + gap, (column + 1) * pitch),
            )
            drawn[there] = cv2.resize(tag, (side, side), interpolation=cv2.INTER_NEAREST)
    return drawn, -np.array(drawn.shape[::-1]) / 2 / SCALE


def to_picture(board: KnownBoard, view: int) -> FloatArray:
    """(3, 3) homography from the board, mm, to the picture, px."""
    drawn, place = print_of(board, from_top=False)
    left, top = place
    right, bottom = place + np.array(drawn.shape[::-1]) / SCALE
    outline = np.array([[left, top], [right, top], [right, bottom], [left, bottom]], np.float32)
    return np.asarray(cv2.getPerspectiveTransform(outline, np.array(VIEWS[view], np.float32)))


def draw(board: KnownBoard, view: int, noise_dn: float, seed: int = 1, from_top: bool = False) -> Image:
    """Picture of the board on white paper, (480, 640), with Gaussian noise."""
    drawn, place_mm = print_of(board, from_top)
    width, height = SIZE_PX
    step = (np.arange(SUBPIXELS) + 0.5) / SUBPIXELS - 0.5
    u = (np.arange(width)[:, None] + step).ravel()
    v = (np.arange(height)[:, None] + step).ravel()
    points = np.stack(np.meshgrid(u, v), axis=2).reshape(1, -1, 2)
    mm = cv2.perspectiveTransform(points, np.linalg.inv(to_picture(board, view)))[0]
    column, row = np.floor((mm - place_mm) * SCALE).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < drawn.shape[1]) & (row < drawn.shape[0])
    tone = np.full(len(mm), PAPER)
    tone[inside] = np.where(drawn[row[inside], column[inside]] > 0, PAPER, INK)
    fine = tone.reshape(height, SUBPIXELS, width, SUBPIXELS).mean(axis=(1, 3))
    blurred = cv2.GaussianBlur(fine, (0, 0), BLUR_PX)
    noisy = blurred + np.random.default_rng(seed).normal(0.0, noise_dn, fine.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), np.uint8)
