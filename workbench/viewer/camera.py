"""The picture and the spots found in it.

Only frames with the lasers on are logged. A frame with the lasers off is dark, serves the subtraction alone
and would double the recording; it stays in the session folder.
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
"""Rerun's (0, 0) is the top-left pixel's corner, the workbench's its centre. Only drawings are shifted."""
_DOT = rr.Radius.ui_points(1.0)
_RING = rr.Radius.ui_points(1.0)
_RING_PX = 9.0
_RING_CORNERS = 36
_SAME_PX = 0.01


def log_series_styles(stream: Stream, colors: Mapping[str, at.Rgb]) -> None:
    """Name and colour of every laser's curve, once."""
    for quantity in QUANTITIES:
        for laser, color in colors.items():
            style = rr.SeriesPoints(colors=color, names=laser, markers="circle", marker_sizes=3.0)
            stream.log(at.under(at.SPOTS, quantity, laser), style, static=True)


def log_frame(stream: Stream, png: bytes) -> None:
    """The picture with the lasers on, exactly as stored."""
    stream.log(at.IMAGE, rr.EncodedImage(contents=png, media_type="image/png"))


def log_spots(stream: Stream, spots: Sequence[Spot], colors: Mapping[str, at.Rgb]) -> None:
    """The spots of one capture: drawn into the picture, and as numbers for curves and for a later fit."""
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
    """The picture's spots again, now that a reading has told whose they are; a stray one stays nameless."""
    named = [replace(spot, laser_id=_owner(spot, lasers)) for spot in spots]
    _draw(stream, named, colors)


def _owner(spot: Spot, lasers: Sequence[LaserRange]) -> str | None:
    """The laser that was ranged by this very spot."""
    for one in lasers:
        if one.u_px is None or one.v_px is None:
            continue
        if hypot(one.u_px - spot.u_px, one.v_px - spot.v_px) < _SAME_PX:
            return one.laser_id
    return spot.laser_id


def _curve(quantity: str, laser: str | None) -> str:
    """Spots of no laser stay out of the curves: from capture to capture they are in no order."""
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
    """A ring about each spot: a dot large enough to be seen would cover the very light that it marks."""
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
