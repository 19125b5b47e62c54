"""Corners of an AprilGrid in a frame."""

from __future__ import annotations

from itertools import product

import cv2
import numpy as np

from workbench.corners.located import LocatedCorners, local_scale
from workbench.corners.markers import Markers, find_markers
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.known_board import AprilGrid

FEWEST_TAGS = 3
"""Tags that show how a board is laid out."""
WINDOW_SHARE = 0.6
"""Half side of the search window at a corner, over the length of the edges that meet there."""
WINDOW_PX = (3, 30)
FARTHEST = 0.15
"""Largest distance of a tag's corner from its place by a homography, over the side of the tag."""


def find_aprilgrid(mean: FloatArray, board: AprilGrid) -> LocatedCorners:
    """Corners of the board's tags in a frame (height, width).

    Boards of different programs number their tags from the bottom row (Kalibr) or from the top row, and print
    them in any of four turns. The layout is the one whose homography fits the corners.
    """
    seen = find_markers(mean, board.dictionary, board.border_bits)
    count = board.tags[0] * board.tags[1]
    own = np.flatnonzero((seen.ids >= board.first_tag) & (seen.ids < board.first_tag + count))
    tags = Markers(seen.ids[own] - board.first_tag, seen.corners_px[own])
    ids, start = _laid_out(tags, board)
    at_mm = board.corners_mm[ids]
    border = board.border_bits / (_cells(board) + 2 * board.border_bits) * board.tag_mm
    side_mm = min(border, board.gap_mm)
    position = _off_the_squares(mean, start, side_mm / board.tag_mm)
    return LocatedCorners(
        ids=ids,
        position_px=position,
        px_per_mm=local_scale(at_mm, at_mm, position),
        side_mm=side_mm,
        clear_mm=side_mm,
        found=f"{len(own)} of its tags",
    )


def _off_the_squares(mean: FloatArray, start_px: FloatArray, share: float) -> FloatArray:
    """(k, 2) corners moved to where tag and small square touch: the detector's contours run into the squares.

    Args:
        mean: the frame.
        start_px: (k, 2) the detector's corners, tag by tag.
        share: length of the edges that meet at a corner, over the side of a tag.
    """
    if not len(start_px):
        return start_px
    tags = start_px.reshape(-1, 4, 2)
    side_px = float(np.median(np.linalg.norm(tags - np.roll(tags, 1, axis=1), axis=2)))
    half = int(np.clip(WINDOW_SHARE * share * side_px, *WINDOW_PX))
    until = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 0.01
    found = cv2.cornerSubPix(
        mean.astype(np.float32), start_px.astype(np.float32), (half, half), (-1, -1), until
    )
    return np.asarray(found, np.float64)


def _cells(board: AprilGrid) -> int:
    """Cells across a tag, without its border."""
    return int(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).markerSize)


def _laid_out(tags: Markers, board: AprilGrid) -> tuple[IndexArray, FloatArray]:
    """Ids (k,) and positions (k, 2) of the corners, by the layout that fits best; none where none fits."""
    none = np.array([], np.intp), np.zeros((0, 2))
    if len(tags.ids) < FEWEST_TAGS:
        return none
    columns, rows = board.tags
    position = tags.corners_px.reshape(-1, 2)
    best, least = none, FARTHEST
    for from_bottom, turn in product((True, False), range(4)):
        row, column = np.divmod(tags.ids, columns)
        home = (rows - 1 - row if from_bottom else row) * columns + column
        ids = (4 * home[:, None] + (np.arange(4) + turn) % 4).ravel()
        misfit = _misfit(board.corners_mm[ids], tags.corners_px)
        good = np.repeat(misfit < FARTHEST, 4)
        if (middle := float(np.median(misfit))) < least:
            best, least = (np.asarray(ids[good], np.intp), position[good]), middle
    return best


def _misfit(printed_mm: FloatArray, corners_px: FloatArray) -> FloatArray:
    """(m,) largest distance of a tag's corners (m, 4, 2) from a homography, over the side of the tag."""
    flat = corners_px.reshape(-1, 2)
    to_image, _ = cv2.findHomography(printed_mm, flat, cv2.LMEDS)
    if to_image is None:
        return np.full(len(corners_px), np.inf)
    there = cv2.perspectiveTransform(printed_mm[None], to_image)[0]
    distance = np.linalg.norm(there - flat, axis=1).reshape(-1, 4).max(axis=1)
    side = np.linalg.norm(corners_px - np.roll(corners_px, 1, axis=1), axis=2).mean(axis=1)
    return np.asarray(distance / side)
