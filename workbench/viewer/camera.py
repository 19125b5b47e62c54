"""Frames and the spots found in them.

Only frames with the lasers on are logged. A frame with the lasers off serves only for the subtraction and
would double the size of the recording; it stays in the session folder.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import hypot

import numpy as np
import rerun as rr

from workbench.model.event import LaserRange
from workbench.model.spot import Spot
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

QUANTITIES = ("u_px", "v_px", "u_sd_px", "v_sd_px", "flux_dn", "width_px", "peak_dn")
RERUN_PIXEL_CENTRE = 0.5
"""Shift of drawings: Rerun's (0, 0) is the corner of the top-left pixel, the workbench's its centre."""
_DOT = rr.Radius.ui_points(1.0)
_RING = rr.Radius.ui_points(1.0)
_RING_PX = 9.0
_RING_CORNERS = 36
_SAME_PX = 0.01


def log_series_styles(stream: Stream, colors: Mapping[str, at.Rgb]) -> None:
    """Log name and colour of every laser's curve."""
    for quantity in QUANTITIES:
        for laser, color in colors.items():
            style = rr.SeriesPoints(colors=color, names=laser, markers="circle", marker_sizes=3.0)
            stream.log(at.under(at.SPOTS, quantity, laser), style, static=True)


def log_frame(stream: Stream, png: bytes) -> None:
    """Log a frame with the lasers on, as stored."""
    stream.log(at.IMAGE, rr.EncodedImage(contents=png, media_type="image/png"))


def log_spots(stream: Stream, spots: Sequence[Spot], colors: Mapping[str, at.Rgb]) -> None:
    """Log the spots of one capture, as marks in the picture and as numbers for curves."""
    _draw(stream, spots, colors)
    by_laser: dict[str | None, list[Spot]] = defaultdict(list)
    for spot in spots:
        by_laser[spot.laser_id].append(spot)
    for laser, found in by_laser.items():
        for quantity in QUANTITIES:
            values = [getattr(spot, quantity) for spot in found]
            stream.log(_curve(quantity, laser), rr.Scalars(values))


def log_assigned(
    stream: Stream, spots: Sequence[Spot], lasers: Sequence[LaserRange], colors: Mapping[str, at.Rgb]
) -> None:
    """Draw the spots of a frame again with the lasers that a reading has assigned to them."""
    assigned = [replace(spot, laser_id=_assigned_laser(spot, lasers)) for spot in spots]
    _draw(stream, assigned, colors)


def _assigned_laser(spot: Spot, lasers: Sequence[LaserRange]) -> str | None:
    """Laser whose range comes from this spot."""
    for one in lasers:
        if one.u_px is None or one.v_px is None:
            continue
        if hypot(one.u_px - spot.u_px, one.v_px - spot.v_px) < _SAME_PX:
            return one.laser_id
    return spot.laser_id


def _curve(quantity: str, laser: str | None) -> str:
    """Entity of a spot's curve. Unassigned spots are separate: their order varies between captures."""
    if laser is None:
        return at.under(at.SPOTS, at.UNASSIGNED, quantity)
    return at.under(at.SPOTS, quantity, laser)


def _draw(stream: Stream, spots: Sequence[Spot], colors: Mapping[str, at.Rgb]) -> None:
    stream.log(at.SPOTS_IN_IMAGE, _dots(spots, colors))
    stream.log(at.RINGS_IN_IMAGE, _rings(spots, colors))


def _dots(spots: Sequence[Spot], colors: Mapping[str, at.Rgb]) -> rr.Points2D:
    return rr.Points2D(
        [(spot.u_px + RERUN_PIXEL_CENTRE, spot.v_px + RERUN_PIXEL_CENTRE) for spot in spots],
        colors=[_color(spot, colors) for spot in spots],
        labels=[_label(spot) for spot in spots],
        show_labels=True,
        radii=_DOT if spots else None,
    )


def _rings(spots: Sequence[Spot], colors: Mapping[str, at.Rgb]) -> rr.LineStrips2D:
    """Rings around spots; a visible dot would cover the spot itself."""
    turn = np.linspace(0.0, 2 * np.pi, _RING_CORNERS + 1)
    ring = _RING_PX * np.column_stack([np.cos(turn), np.sin(turn)]) + RERUN_PIXEL_CENTRE
    return rr.LineStrips2D(
        [ring + np.array([spot.u_px, spot.v_px]) for spot in spots],
        colors=[_color(spot, colors) for spot in spots],
        radii=_RING if spots else None,
    )


def _color(spot: Spot, colors: Mapping[str, at.Rgb]) -> at.Rgb:
    return colors.get(spot.laser_id or at.UNASSIGNED, at.WHITE)


def _label(spot: Spot) -> str:
    flags = f" ({', '.join(sorted(spot.flags))})" if spot.flags else ""
    return f"{spot.laser_id or '?'}{flags}"
