"""The printed target: two ChArUco blocks with a blank band between them, on which the laser spots fall.

Frame of the board: origin in the middle of the band, x to the right, y down, z into the paper, millimetres as
printed at true size. Turned by a quarter, the band takes the spots of lasers above and below the camera.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workbench.model.arrays import FloatArray
from workbench.model.bounds import within
from workbench.model.yamlfile import FileModel

Millimetres = Annotated[float, within(0.01, 10_000, "millimetres")]
PAGE_MARGIN_MM = 5.0
"""Margin on each side that printers leave blank."""
BELOW_MM = 13.0
"""Height above and below the blocks for the instructions and the ruler."""
BOW_RADIUS_MM = 100.0
"""Distance from the board's centre at which the sag of the paper is stated."""
BOW = ("bow_x_mm", "bow_y_mm", "bow_xy_mm")


class Board(FileModel):
    """Nominal dimensions of the printed board. The defaults fill an A4 page in landscape format."""

    kind: Literal["banded"] = "banded"
    columns: Annotated[int, Field(ge=3, le=1000)] = 13
    rows: Annotated[int, Field(ge=2, le=1000)] = 4
    """Rows of squares in each of the two blocks."""
    square_mm: Millimetres = 20.0
    marker_mm: Millimetres = 15.0
    band_mm: Millimetres = 24.0
    """Height of the blank band."""
    dictionary: Literal["DICT_4X4_100", "DICT_4X4_250", "DICT_5X5_100", "DICT_5X5_250"] = "DICT_4X4_100"
    page_mm: tuple[Millimetres, Millimetres] = (297.0, 210.0)
    """Width and height."""

    @model_validator(mode="after")
    def _fits_together(self) -> Board:
        if not self.marker_mm < self.square_mm:
            raise ValueError("expected marker_mm smaller than square_mm: markers stand inside white squares")
        width, height = self.columns * self.square_mm, self.band_mm + 2 * self.rows * self.square_mm
        room = self.page_mm[0] - 2 * PAGE_MARGIN_MM, self.page_mm[1] - 2 * BELOW_MM
        if width > room[0] or height > room[1]:
            raise ValueError(
                f"expected blocks within {room[0]:g} x {room[1]:g} mm of the page, got {width:g} x {height:g}"
            )
        capacity = int(self.dictionary.rsplit("_", 1)[1])
        if 2 * self.markers > capacity:
            raise ValueError(
                f"expected at most {capacity} markers ({self.dictionary}), got {2 * self.markers}"
            )
        return self

    @property
    def markers(self) -> int:
        """Number of markers in each block: one in every white square; the top left square is black."""
        return self.columns * self.rows // 2

    @property
    def block_tops_mm(self) -> tuple[float, float]:
        """Y of the upper edge of the upper and of the lower block."""
        return -self.band_mm / 2 - self.rows * self.square_mm, self.band_mm / 2

    @property
    def left_mm(self) -> float:
        """X of the blocks' left edge."""
        return -self.columns * self.square_mm / 2

    @cached_property
    def corners_mm(self) -> FloatArray:
        """(K, 2) x, y of every inner corner: upper block first, then row by row."""
        x = self.left_mm + self.square_mm * np.arange(1, self.columns)
        y = np.concatenate([top + self.square_mm * np.arange(1, self.rows) for top in self.block_tops_mm])
        xx, yy = np.meshgrid(x, y)
        return np.column_stack([xx.ravel(), yy.ravel()])

    @property
    def corners_per_block(self) -> int:
        """Number of inner corners of one block; corner ids of the lower block start at this number."""
        return (self.columns - 1) * (self.rows - 1)

    def black_mm(self) -> FloatArray:
        """(n, 4) left, top, width, height of every black rectangle: squares, and cells of the markers."""
        squares = [
            (
                self.left_mm + column * self.square_mm,
                top + row * self.square_mm,
                self.square_mm,
                self.square_mm,
            )
            for top in self.block_tops_mm
            for row in range(self.rows)
            for column in range(self.columns)
            if (row + column) % 2 == 0
        ]
        return np.array([*squares, *self._marker_cells()])

    def _marker_cells(self) -> list[tuple[float, float, float, float]]:
        import cv2  # imported here: the command line's help does not need it

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        modules = dictionary.markerSize + 2
        side, margin = self.marker_mm / modules, (self.square_mm - self.marker_mm) / 2
        homes = [
            (self.left_mm + column * self.square_mm + margin, top + row * self.square_mm + margin)
            for top in self.block_tops_mm
            for row in range(self.rows)
            for column in range(self.columns)
            if (row + column) % 2 == 1
        ]
        return [
            (left + side * column, top + side * row, side, side)
            for number, (left, top) in enumerate(homes)
            for row, column in np.argwhere(dictionary.generateImageMarker(number, modules) == 0).tolist()
        ]


def sag_mm(bow_mm: FloatArray, points_mm: FloatArray) -> FloatArray:
    """Sag of the paper at board points: (n,) distances behind the nominal plane, mm.

    The sag is modelled as a quadratic form of the position.

    Args:
        bow_mm: (3,) coefficients of x^2, y^2 and x y at `BOW_RADIUS_MM`, in the order of `BOW`.
        points_mm: (n, 2) points of the board.
    """
    x, y = points_mm[:, 0] / BOW_RADIUS_MM, points_mm[:, 1] / BOW_RADIUS_MM
    return np.asarray(bow_mm[0] * x * x + bow_mm[1] * y * y + bow_mm[2] * x * y)
