"""Printed board on the virtual bench: its intersection with rays, and its image in room light.

Room light is uniform on the board. The brightness of a pixel is the mean of the print over the pixel, blurred
by the lens. The integral of the print (exact for black rectangles) is evaluated at the outline of every
sample, so that edges are accurate to about 1e-3 px even with coarse samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from workbench.emulator.lens import Lens
from workbench.emulator.spec import SurfaceSpec
from workbench.emulator.spot import ImageFormat
from workbench.emulator.surfaces import Alone
from workbench.emulator.truth import BoardError, PlacementError, Truth
from workbench.model.arrays import BoolArray, Float32Array, FloatArray
from workbench.model.board import Board, sag_mm
from workbench.model.target import BoardTarget

CELLS_PER_MM = 10
SAMPLES = 3
"""Samples along a pixel's side."""
SAG_STEPS = 3
"""Number of fixed-point steps for the sag; each gains three digits for a sag below a millimetre."""


class Print:
    """Image of the print: 1 is paper, `ink` is ink; board frame, mm."""

    def __init__(self, board: Board, ink: float) -> None:
        self._half = np.array(board.page_mm) / 2
        width, height = (math.ceil(side * CELLS_PER_MM) for side in board.page_mm)
        black = np.zeros((height, width))
        for left, top, w, h in board.black_mm():
            columns = _covered(left + self._half[0], w, width)
            rows = _covered(top + self._half[1], h, height)
            black[rows.first : rows.last, columns.first : columns.last] += np.outer(rows.share, columns.share)
        self._tone = 1 - (1 - ink) * np.minimum(black, 1.0)
        self._integral = np.pad(self._tone.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    def on_page(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Whether board points lie on the paper."""
        return np.asarray((np.abs(x) < self._half[0]) & (np.abs(y) < self._half[1]), np.bool_)

    def tone(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Tone at board points, mm."""
        at = np.array([(y + self._half[1]) * CELLS_PER_MM - 0.5, (x + self._half[0]) * CELLS_PER_MM - 0.5])
        return np.asarray(map_coordinates(self._tone, at, order=1, mode="nearest"), np.float64)

    def mean_tone(self, x: FloatArray, y: FloatArray, half_x: FloatArray, half_y: FloatArray) -> FloatArray:
        """Mean tone of rectangles around board points, half sides given, mm."""
        left, right = x - half_x, x + half_x
        top, bottom = y - half_y, y + half_y
        total = (
            self._sum(right, bottom) - self._sum(left, bottom) - self._sum(right, top) + self._sum(left, top)
        )
        return np.asarray(total / (4 * half_x * half_y * CELLS_PER_MM**2), np.float64)

    def _sum(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Integral of the tone from the page's corner, exact because the tone is constant in every cell."""
        at = np.array([(y + self._half[1]) * CELLS_PER_MM, (x + self._half[0]) * CELLS_PER_MM])
        return np.asarray(map_coordinates(self._integral, at, order=1, mode="nearest"), np.float64)


@dataclass(frozen=True)
class BoardSurface(Alone):
    """Placed board, camera frame, mm; the front side faces the sensor."""

    origin_mm: FloatArray
    """Centre of the band, (3,)."""
    axes: FloatArray
    """Rows (3, 3): x axis, y axis, and z axis into the paper."""
    scale: float
    """True length / nominal length."""
    bow_mm: FloatArray
    """Sag coefficients (3,), see `sag_mm`."""
    print: Print
    albedo: float
    """Diffuse reflectance of the paper."""

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`."""
        normal = self.axes[2]
        with np.errstate(divide="ignore", invalid="ignore"):
            facing = direction @ normal
            to_plane = (self.origin_mm - origin) @ normal
            t = np.broadcast_to(to_plane / facing, len(direction))
            for _ in range(SAG_STEPS):
                x, y = self._on_board(origin + t[:, None] * direction)
                t = (to_plane + sag_mm(self.bow_mm, np.column_stack([x, y]))) / facing
            return np.where((t > 0) & self.print.on_page(x, y), t, np.nan)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`; the slope of the sag, about 1e-3, is neglected."""
        return np.broadcast_to(-self.axes[2], points.shape)

    def shade(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        return self.print.tone(*self._on_board(points))

    def lit_by_room(self, lens: Lens, image: ImageFormat, blur_px: float) -> Float32Array:
        """Brightness (height, width) in room light, 1 for the paper and for everything beside the board."""
        n = SAMPLES
        offsets = (np.arange(n) + 0.5) / n - 0.5
        u = (np.arange(image.width)[:, None] + offsets).ravel()
        v = (np.arange(image.height)[:, None] + offsets).ravel()
        sight = lens.back_project_grid(
            np.arange(-2.0, image.width + 2), np.arange(-2.0, image.height + 2), u, v
        )
        direction = np.column_stack([sight.x.ravel(), sight.y.ravel(), np.ones(sight.x.size)])
        depth = self.depth(np.zeros(3), direction)
        x, y = (c.reshape(sight.x.shape) for c in self._on_board(depth[:, None] * direction))
        half_x, half_y = (0.5 * sum(np.abs(g) for g in np.gradient(c)) for c in (x, y))
        seen = np.isfinite(half_x) & np.isfinite(half_y)
        tone = np.ones(x.shape)
        tone[seen] = self.print.mean_tone(x[seen], y[seen], half_x[seen], half_y[seen])
        if blur_px > 0:
            tone = gaussian_filter(tone, blur_px * n, mode="nearest", truncate=5.0)
        return np.asarray(tone.reshape(image.height, n, image.width, n).mean(axis=(1, 3)), np.float32)

    def _on_board(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nominal board coordinates x, y (mm) of points (n, 3)."""
        along = (points - self.origin_mm) @ self.axes[:2].T / self.scale
        return along[:, 0], along[:, 1]


def stand(
    target: BoardTarget,
    z_mm: float,
    error: PlacementError,
    aside: BoardError,
    truth: Truth,
    printed: Print,
    finish: SurfaceSpec,
) -> BoardSurface:
    """Board on the plane z = z_mm + tan(yaw) x + tan(pitch) y, with centre and roll of `aside`."""
    slope_x = math.tan(math.radians(target.yaw_deg + error.yaw_deg))
    slope_y = math.tan(math.radians(target.pitch_deg + error.pitch_deg))
    across = np.array([1.0, 0.0, slope_x]) / math.hypot(1, slope_x)
    into = np.array([-slope_x, -slope_y, 1.0]) / math.sqrt(1 + slope_x**2 + slope_y**2)
    down = np.cross(into, across)
    roll = math.radians(target.roll_deg + aside.roll_deg)
    middle = np.array([aside.x_mm, aside.y_mm, z_mm + slope_x * aside.x_mm + slope_y * aside.y_mm])
    axes = np.array(
        [
            math.cos(roll) * across + math.sin(roll) * down,
            -math.sin(roll) * across + math.cos(roll) * down,
            into,
        ]
    )
    bow = np.array([truth.bow_x_mm, truth.bow_y_mm, truth.bow_xy_mm])
    return BoardSurface(middle, axes, 1 + truth.print_scale, bow, printed, finish.albedo)


@dataclass(frozen=True)
class _Covered:
    """Raster cells that an interval covers, with the covered share of each."""

    first: int
    last: int
    share: FloatArray


def _covered(start_mm: float, length_mm: float, cells: int) -> _Covered:
    low, high = start_mm * CELLS_PER_MM, (start_mm + length_mm) * CELLS_PER_MM
    first, last = max(0, math.floor(low)), min(cells, math.ceil(high))
    edges = np.clip(np.arange(first, last + 1), low, high)
    return _Covered(first, last, np.diff(edges))
