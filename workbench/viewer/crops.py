"""Crops of the frames around the spots of all lasers, magnified, in one picture.

Each laser has a cell of two squares: the lit frame minus the dark frame, and beside it what remains after
subtraction of the fitted profiles. Brightness is the square root of the signal, each square relative to the
peak of its spot. Squares of lasers that were lit earlier at the same placement stay, labelled "earlier".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

import cv2
import numpy as np
import rerun as rr
from scipy.special import ndtr

from workbench.model.arrays import FloatArray, Image
from workbench.model.number_text import counted
from workbench.model.spot import Failure, Spot
from workbench.viewer import entities as at
from workbench.viewer.frame import RERUN_PIXEL_CENTRE
from workbench.viewer.stream import Stream

SIDE_PX = 41
"""Side of a square, pixels of the frame."""
GAP_PX = 3
LABEL_PX = 10
"""Height of the line of labels above each row of squares."""
CROSS_PX = (4.0, 9.0)
"""Inner and outer end of the arms of the cross at a centre."""
ELLIPSES_SD = (1.0, 10.0)
"""Half axes of the drawn ellipses in standard deviations of the centre."""
RESIDUAL_GAIN = 4.0
"""Factor on the brightness of the residual, which is a few per cent of the spot."""
MIDDLE = 128
_THIN = rr.Radius.ui_points(0.75)
_NO_DOT = rr.Radius.ui_points(0.0)


Capture = tuple[Image, Image | None, Sequence[Spot], Mapping[str, FloatArray]]
"""Arguments of `Crops.take`."""


@dataclass(frozen=True)
class Crop:
    """Square of a frame around one laser's spot."""

    signal: FloatArray
    """(SIDE_PX, SIDE_PX) lit minus dark, DN; 0 beyond the frame."""
    left_px: int
    """Column of the frame of the square's first column."""
    top_px: int
    spot: Spot | None
    """None: no spot, or several that may be the laser's; the square then shows the brightest of these, or
    where the spot was expected."""
    others: tuple[Spot, ...] = ()
    """The other spots of the capture, which may lie in the square."""
    candidates: tuple[Spot, ...] = ()
    """Spots that may each be the laser's, the brightest first, where only this laser was on."""

    # Cached, because a crop stays in the picture while the other lasers are captured.
    @cached_property
    def squares(self) -> tuple[Image, Image]:
        """The square of the signal, and that of the residual (grey where the profile fits)."""
        return drawn(self)

    @property
    def has_defect(self) -> bool:
        """Whether the spot is saturated, or one of several."""
        return bool(self.candidates) or (self.spot is not None and Failure.SATURATED in self.spot.flags)

    @cached_property
    def cross(self) -> FloatArray:
        """(4, 2, 2) arms of the cross, px of the square."""
        return self._in_square(cross)

    @cached_property
    def ellipses(self) -> FloatArray:
        """(2, 25, 2) outlines, px of the square."""
        return self._in_square(ellipses)

    def _in_square(self, of: Callable[[Spot], list[FloatArray]]) -> FloatArray:
        """Lines about the centre of the spot, cut at the edge of the square; none without a spot."""
        if self.spot is None:
            return np.empty((0, 2, 2))
        return np.clip(np.array(of(self.spot)) - [self.left_px, self.top_px], -0.5, SIDE_PX - 0.5)


@dataclass
class Crops:
    """Latest crop of each laser at the present placement."""

    stream: Stream
    colors: Mapping[str, at.Rgb]
    latest: dict[str, Crop] = field(default_factory=dict)
    earlier: set[str] = field(default_factory=set)
    """Lasers whose crop is of an earlier capture at the same placement."""

    def log_none(self) -> None:
        """Remove the crops of the previous placement and log an empty picture."""
        self.latest.clear()
        self.earlier.clear()
        self._log()

    def take(
        self, on: Image, off: Image | None, spots: Sequence[Spot], expected: Mapping[str, FloatArray]
    ) -> None:
        """Log the crops of one capture.

        Args:
            on: frame with the lasers on, (height, width).
            off: frame with the lasers off.
            spots: spots of the capture, with their lasers. Those without one may be the laser's where only
                one laser was on.
            expected: (2,) expected position, px, of the spot of each laser that was on.
        """
        self.earlier = set(self.latest)
        self._add(on, off, spots, expected)
        self._log()

    def take_each(self, captures: Sequence[Capture]) -> None:
        """Log the crops of captures of one laser each, in place of all earlier ones."""
        self.latest.clear()
        self.earlier.clear()
        for capture in captures:
            self._add(*capture)
        self._log()

    def _add(
        self, on: Image, off: Image | None, spots: Sequence[Spot], expected: Mapping[str, FloatArray]
    ) -> None:
        by_laser = {spot.laser_id: spot for spot in spots if spot.laser_id in self.colors}
        for laser in self.colors:
            if laser not in by_laser and laser not in expected:
                continue
            spot = by_laser.get(laser)
            candidates = _by_brightness(spots) if spot is None and len(expected) == 1 else ()
            shown = next(iter(candidates), spot)
            centre = expected[laser] if shown is None else np.array([shown.u_px, shown.v_px])
            if np.isfinite(centre).all():
                others = tuple(one for one in spots if one is not spot)
                self.latest[laser] = _crop(on, off, centre, spot, others, candidates)
                self.earlier.discard(laser)

    def _log(self) -> None:
        lasers = list(self.colors)
        png = cv2.imencode(".png", mosaic([self.latest.get(laser) for laser in lasers]))[1].tobytes()
        self.stream.log(at.CROPS_IMAGE, rr.EncodedImage(contents=png, media_type="image/png"))
        places, labels, label_colors = [], [], []
        for n, laser in enumerate(lasers):
            column, row = cell_corner(n, len(lasers))
            crop = self.latest.get(laser)
            places.append((column + SIDE_PX + GAP_PX / 2, row - LABEL_PX))  # the viewer draws below a point
            labels.append(label(laser, crop, laser in self.earlier))
            has_defect = crop is not None and crop.has_defect
            label_colors.append(at.RED if has_defect else self.colors[laser])
        self._log_outlines(at.CROPS_CENTRES, lambda crop: crop.cross)
        self._log_outlines(at.CROPS_ELLIPSES, lambda crop: crop.ellipses)
        self.stream.log(
            at.CROPS_LABELS,
            rr.Points2D(
                places, labels=labels, colors=at.packed(label_colors), radii=_NO_DOT, show_labels=True
            ),
        )

    def _log_outlines(self, entity: str, of: Callable[[Crop], FloatArray]) -> None:
        """Log lines about the centre of each crop's spot."""
        strips: list[FloatArray] = []
        colors: list[at.Rgb] = []
        for n, (laser, color) in enumerate(self.colors.items()):
            crop = self.latest.get(laser)
            if crop is None or crop.spot is None:
                continue
            lines = of(crop) + np.array(cell_corner(n, len(self.colors))) + RERUN_PIXEL_CENTRE
            strips += [*lines]
            colors += [color] * len(lines)
        # As one array it is converted ten times faster.
        drawn_strips = np.array(strips, dtype=np.float32)
        self.stream.log(
            entity,
            rr.LineStrips2D(drawn_strips, colors=at.packed(colors), radii=_THIN if strips else None),
        )


def label(laser: str, crop: Crop | None, is_earlier: bool) -> str:
    """Text above a laser's squares."""
    if crop is None:
        return laser
    earlier = " earlier" if is_earlier else ""
    if crop.candidates:
        return f"{laser}{earlier} {counted(len(crop.candidates), 'spot')}, not assigned"
    if crop.spot is None:
        return f"{laser}{earlier} no spot"
    flags = "".join(f", {flag}" for flag in sorted(crop.spot.flags))
    peak = f" peak {crop.spot.peak_dn:.0f} DN" if np.isfinite(crop.spot.peak_dn) else ""
    return f"{laser}{earlier}{peak}{flags}"


def grid_size(lasers: int) -> tuple[int, int]:
    """Columns and rows of cells."""
    columns = max(1, ceil(lasers / 2))
    return columns, ceil(lasers / columns)


def cell_corner(index: int, lasers: int) -> tuple[int, int]:
    """Column and row of the mosaic of the first pixel of a laser's first square."""
    columns, _ = grid_size(lasers)
    row, column = divmod(index, columns)
    return GAP_PX + column * (2 * SIDE_PX + 3 * GAP_PX), LABEL_PX + row * (SIDE_PX + LABEL_PX + GAP_PX)


def mosaic_size(lasers: int) -> tuple[int, int]:
    """Width and height of the mosaic, px."""
    columns, rows = grid_size(lasers)
    return columns * (2 * SIDE_PX + 3 * GAP_PX), rows * (SIDE_PX + LABEL_PX + GAP_PX)


def mosaic(crops: Sequence[Crop | None]) -> Image:
    """Grey picture of all lasers' squares, in the order of the rig file."""
    width, height = mosaic_size(len(crops))
    canvas = np.full((height, width), 26, np.uint8)
    for n, crop in enumerate(crops):
        column, row = cell_corner(n, len(crops))
        squares = (np.zeros((SIDE_PX, SIDE_PX), np.uint8),) * 2 if crop is None else crop.squares
        for k, square in enumerate(squares):
            left = column + k * (SIDE_PX + GAP_PX)
            canvas[row : row + SIDE_PX, left : left + SIDE_PX] = square
    return canvas


def drawn(crop: Crop) -> tuple[Image, Image]:
    """The square of the signal, and that of the residual (grey where the profile fits)."""
    peak = max(float(crop.signal.max()), 1.0)
    shown = 255.0 * np.sqrt(np.clip(crop.signal / peak, 0.0, 1.0))
    spot = next(iter(crop.candidates), crop.spot)
    if spot is None or not np.isfinite(spot.flux_dn):
        return shown.astype(np.uint8), np.full((SIDE_PX, SIDE_PX), MIDDLE, np.uint8)
    known = [one for one in dict.fromkeys((spot, *crop.others)) if np.isfinite(one.flux_dn)]
    fitted = [profile(one, crop.left_px, crop.top_px) for one in known]
    residual = crop.signal - np.sum(fitted, axis=0)
    scaled = MIDDLE + RESIDUAL_GAIN * MIDDLE * residual / max(spot.peak_dn, 1.0)
    return shown.astype(np.uint8), np.clip(scaled, 0, 255).astype(np.uint8)


def profile(spot: Spot, left_px: int, top_px: int) -> FloatArray:
    """(SIDE_PX, SIDE_PX) Gaussian profile of a spot, integrated over pixels, DN above the background."""

    def along(centre: float, first: int) -> FloatArray:
        edges = (np.arange(SIDE_PX + 1) + first - 0.5 - centre) / max(spot.width_px, 0.1)
        return np.asarray(np.diff(ndtr(edges)))

    return spot.flux_dn * np.outer(along(spot.v_px, top_px), along(spot.u_px, left_px))


def cross(spot: Spot) -> list[FloatArray]:
    """Arms (2, 2), px, of a cross at a spot's centre, with a gap that leaves the spot visible."""
    centre = np.array([spot.u_px, spot.v_px])
    inner, outer = CROSS_PX
    return [
        np.array([centre + inner * way, centre + outer * way])
        for way in np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    ]


def ellipses(spot: Spot) -> list[FloatArray]:
    """Outlines (25, 2), px, at `ELLIPSES_SD` standard deviations of a spot's centre."""
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    axes = np.array([spot.u_sd_px, spot.v_sd_px])
    return [np.array([spot.u_px, spot.v_px]) + sd * axes * circle for sd in ELLIPSES_SD]


def _by_brightness(spots: Sequence[Spot]) -> tuple[Spot, ...]:
    """Spots of no laser, the brightest first."""
    found = [spot for spot in spots if spot.laser_id is None]
    return tuple(sorted(found, key=lambda spot: -spot.peak_dn if np.isfinite(spot.peak_dn) else 0.0))


def _crop(
    on: Image,
    off: Image | None,
    centre: FloatArray,
    spot: Spot | None,
    others: tuple[Spot, ...],
    candidates: tuple[Spot, ...],
) -> Crop:
    left, top = (round(float(c)) - SIDE_PX // 2 for c in centre)
    square = np.zeros((SIDE_PX, SIDE_PX))
    height, width = on.shape
    rows, columns = (
        slice(max(top, 0), max(min(top + SIDE_PX, height), 0)),
        slice(max(left, 0), max(min(left + SIDE_PX, width), 0)),
    )
    inside = on[rows, columns].astype(np.float64)
    if off is not None:
        inside -= off[rows, columns]
    if inside.size:
        square[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = inside
    return Crop(square, left, top, spot, others, candidates)
