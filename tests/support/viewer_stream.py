"""What parts of the viewer log, read back from a recording of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import erf, pi, sqrt
from pathlib import Path

import cv2
import numpy as np

from tests.viewer.readback import Contents
from tests.viewer.session import a_rig
from workbench.model.arrays import FloatArray, Image
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.spot import Failure, Spot
from workbench.viewer.blueprint import blueprint
from workbench.viewer.entities import Rgb, laser_colors
from workbench.viewer.stream import Moment, Stream

START_NS = 1_790_000_000_000_000_000
HERE = Moment(1, 1, START_NS, 500.0)
COLORS = laser_colors(a_rig().laser_ids)


def logged(folder: Path, log: Callable[[Stream], object]) -> Contents:
    """Everything that `log` writes, beginning at `HERE`."""
    stream = Stream(folder / "part.rrd", "part", blueprint(a_rig()))
    stream.at(HERE)
    log(stream)
    stream.close()
    return Contents(folder / "part.rrd")


def packed(color: Rgb) -> int:
    """A colour as Rerun keeps it, opaque."""
    red, green, blue = color
    return red << 24 | green << 16 | blue << 8 | 255


def png_of(image: Image) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def gaussian(spot: Spot, shape: tuple[int, int]) -> FloatArray:
    """(height, width) DN of a spot's profile, integrated over pixels by the error function."""

    def along(centre: float, pixels: int) -> FloatArray:
        edges = [erf((i - 0.5 - centre) / (sqrt(2) * spot.width_px)) / 2 for i in range(pixels + 1)]
        return np.diff(edges)

    return spot.flux_dn * np.outer(along(spot.v_px, shape[0]), along(spot.u_px, shape[1]))


def bright_spot(laser: str | None, u_px: float, v_px: float, peak_dn: float, width_px: float = 1.5) -> Spot:
    """A spot whose flux and peak belong together."""
    return Spot(
        laser_id=laser,
        u_px=u_px,
        v_px=v_px,
        u_sd_px=0.05,
        v_sd_px=0.05,
        flux_dn=peak_dn * 2 * pi * width_px**2,
        width_px=width_px,
        peak_dn=peak_dn,
    )


def drawn_frame(spots: Sequence[Spot], ambient_dn: float, shape: tuple[int, int] = (480, 640)) -> Image:
    """Frame of 16 bits without noise."""
    signal = sum((gaussian(spot, shape) for spot in spots), np.zeros(shape))
    return np.round(ambient_dn + signal).astype(np.uint16)


def a_spot(laser: str | None, u_px: float, v_px: float = 240.0, *flags: Failure) -> Spot:
    return Spot(
        laser_id=laser,
        u_px=u_px,
        v_px=v_px,
        u_sd_px=0.1,
        v_sd_px=0.2,
        flux_dn=1000.0,
        width_px=1.5,
        peak_dn=80.0,
        flags=frozenset(flags),
    )


def a_range(laser: str, range_mm: float, sigma_mm: float = 1.0, u_px: float | None = None) -> LaserRange:
    v_px = None if u_px is None else 240.0
    return LaserRange(laser_id=laser, range_mm=range_mm, sigma_mm=sigma_mm, u_px=u_px, v_px=v_px)


def a_reading(
    standoff_mm: float, range_mm: float | None, *lasers: LaserRange, trial: str = "t", reading: int = 0
) -> ReadingTaken:
    return ReadingTaken(
        trial=trial,
        scene="s",
        standoff_mm=standoff_mm,
        reading=reading,
        status="no_points" if range_mm is None else "done",
        range_mm=range_mm,
        sigma_mm=None if range_mm is None else 2.0,
        lasers=lasers,
    )
