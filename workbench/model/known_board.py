"""Calibration boards that others print: chessboards, ChArUco boards and AprilGrids.

Frame of a board: origin in the middle of its corners, x to the right, y down, z into the paper, millimetres.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from workbench.model.arrays import FloatArray
from workbench.model.board import Board, Millimetres
from workbench.model.yamlfile import FileModel

FEWEST_CORNERS = 12
"""Least number of corners in a view: a pose has six unknowns, so that one bad corner is redundant."""
Number = Annotated[int, Field(ge=2, le=1000)]

Dictionary = Literal[
    "DICT_4X4_50",
    "DICT_4X4_100",
    "DICT_4X4_250",
    "DICT_4X4_1000",
    "DICT_5X5_50",
    "DICT_5X5_100",
    "DICT_5X5_250",
    "DICT_5X5_1000",
    "DICT_6X6_50",
    "DICT_6X6_100",
    "DICT_6X6_250",
    "DICT_6X6_1000",
    "DICT_7X7_50",
    "DICT_7X7_100",
    "DICT_7X7_250",
    "DICT_7X7_1000",
    "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_16h5",
    "DICT_APRILTAG_25h9",
    "DICT_APRILTAG_36h10",
    "DICT_APRILTAG_36h11",
    "DICT_ARUCO_MIP_36h12",
]
"""Names of OpenCV's predefined dictionaries of markers."""
Family = Literal["16h5", "25h9", "36h10", "36h11"]
"""Families of AprilTags."""
CAPACITY = {
    "DICT_ARUCO_ORIGINAL": 1024,
    "DICT_APRILTAG_16h5": 30,
    "DICT_APRILTAG_25h9": 35,
    "DICT_APRILTAG_36h10": 2320,
    "DICT_APRILTAG_36h11": 587,
    "DICT_ARUCO_MIP_36h12": 250,
}
"""Number of markers of the dictionaries whose name does not state it."""


class Chessboard(FileModel):
    """A chessboard, as OpenCV's and ROS's calibration tools use it. The whole board must be visible."""

    kind: Literal["chessboard"]
    corners: tuple[Number, Number]
    """Inner corners across and down: one less than squares."""
    square_mm: Millimetres
    refine: Literal["edges", "opencv"] = "edges"
    """Sub-pixel position: by the workbench's fit of crossing edges, or by OpenCV's `cornerSubPix` with a half
    window of 11 px, to compare with calibrations that others made (docs/decisions/0012)."""

    @model_validator(mode="after")
    def _has_enough_corners(self) -> Chessboard:
        _check_corners(self.corners[0] * self.corners[1])
        return self

    @cached_property
    def corners_mm(self) -> FloatArray:
        """(K, 2) x, y of every inner corner, row by row."""
        return _grid_mm(self.corners, self.square_mm)


class CharucoBoard(FileModel):
    """A ChArUco board: a chessboard whose white squares have ArUco markers."""

    kind: Literal["charuco"]
    squares: tuple[Number, Number]
    """Squares across and down."""
    square_mm: Millimetres
    marker_mm: Millimetres
    dictionary: Dictionary
    first_marker: Annotated[int, Field(ge=0, le=10_000)] = 0
    """Id of the first marker."""
    legacy_pattern: bool = False
    """Pattern of OpenCV before 4.6: for an even number of rows the top left square is white."""

    @model_validator(mode="after")
    def _fits_together(self) -> CharucoBoard:
        if not self.marker_mm < self.square_mm:
            raise ValueError("expected marker_mm smaller than square_mm: markers stand inside white squares")
        _check_corners((self.squares[0] - 1) * (self.squares[1] - 1))
        _check_markers(self.dictionary, self.first_marker + self.squares[0] * self.squares[1] // 2)
        return self

    @cached_property
    def corners_mm(self) -> FloatArray:
        """(K, 2) x, y of every inner corner, row by row."""
        return _grid_mm((self.squares[0] - 1, self.squares[1] - 1), self.square_mm)


class AprilGrid(FileModel):
    """An AprilGrid of Kalibr: AprilTags with small black squares between their corners."""

    kind: Literal["aprilgrid"]
    tags: tuple[Number, Number]
    """Tags across and down."""
    tag_mm: Millimetres
    """Side of a tag's black square."""
    spacing: Annotated[float, Field(ge=0.05, le=1.0)]
    """Gap between two tags over the side of a tag, as `tagSpacing` of Kalibr."""
    family: Family = "36h11"
    border_bits: Literal[1, 2] = 2
    """Width of a tag's black border in cells: 2 in Kalibr's boards, 1 in those of others."""
    first_tag: Annotated[int, Field(ge=0, le=10_000)] = 0
    """Id of the first tag."""

    @model_validator(mode="after")
    def _fits_together(self) -> AprilGrid:
        _check_corners(4 * self.tags[0] * self.tags[1])
        _check_markers(self.dictionary, self.first_tag + self.tags[0] * self.tags[1])
        return self

    @property
    def dictionary(self) -> str:
        """OpenCV's name of the family."""
        return f"DICT_APRILTAG_{self.family}"

    @property
    def gap_mm(self) -> float:
        """Gap between two tags, and side of the small squares."""
        return self.spacing * self.tag_mm

    @cached_property
    def corners_mm(self) -> FloatArray:
        """(K, 2) x, y of every tag's corners: tag by tag from the top left, each clockwise from its own."""
        home = _grid_mm(self.tags, self.tag_mm + self.gap_mm)
        side = self.tag_mm / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return np.asarray((home[:, None] + side).reshape(-1, 2))


def _with_kind(board: Any) -> Any:
    """The board with the kind of the workbench's own board, where the file states none."""
    return {"kind": "banded", **board} if isinstance(board, dict) and "kind" not in board else board


AnyBoard = Annotated[
    Annotated[Board | Chessboard | CharucoBoard | AprilGrid, Field(discriminator="kind")],
    BeforeValidator(_with_kind),
]
"""Board of a rig file."""


def _grid_mm(count: tuple[int, int], pitch_mm: float) -> FloatArray:
    """(n, 2) points of a grid about the origin, row by row."""
    x, y = ((np.arange(n) - (n - 1) / 2) * pitch_mm for n in count)
    xx, yy = np.meshgrid(x, y)
    return np.column_stack([xx.ravel(), yy.ravel()])


def _check_corners(count: int) -> None:
    if count < FEWEST_CORNERS:
        raise ValueError(f"expected a board of at least {FEWEST_CORNERS} corners, got {count}")


def _check_markers(dictionary: str, count: int) -> None:
    last = dictionary.rsplit("_", 1)[1]
    capacity = CAPACITY[dictionary] if dictionary in CAPACITY else int(last)
    if count > capacity:
        raise ValueError(f"expected at most {capacity} markers ({dictionary}), got {count}")
