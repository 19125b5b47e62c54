"""Frames with the spots found in them, and curves of the spots' quantities.

A frame is shown with its contrast stretched: grey levels run from 0 to a few times the room light, so that
spots of some pixels and their surroundings are visible. Marks leave the spots themselves uncovered.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from math import hypot, nan

import cv2
import numpy as np
import rerun as rr

from workbench.model.arrays import FloatArray, Image
from workbench.model.errors import BadInputError
from workbench.model.event import LaserRange
from workbench.model.spot import Spot
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

QUANTITIES = ("u_px", "v_px", "peak_dn")
"""Quantities with a curve for each laser."""
RECORDED = tuple(field.name for field in fields(Spot) if field.name not in {"flags", "laser_id"})
"""Quantities in the record of all spots of a capture, as stored in the journal; NaN: not known."""
RERUN_PIXEL_CENTRE = 0.5
"""Shift of drawings: Rerun's (0, 0) is the corner of the top-left pixel, the workbench's its centre."""
AMBIENT_SHARE = 0.12
"""Grey level of the room light, as a share of white."""
LEAST_WHITE = 0.25
"""Least value that is shown as white, as a share of full scale; above the noise of a dark room."""
PNG_SIGNATURE = b"\x89PNG"
SAMPLED = 8
"""Distance of the rows and columns from which the room light is taken."""
LABEL_DISTANCE_PX = 44.0
"""Distance between labels of neighbouring spots."""
LEADER_PX = (8.0, 40.0)
"""Ends of the line from a spot to its label: distances from the spot along columns."""
LABEL_HEIGHT_PX = 12.0
"""Height that a label takes below the end of its line."""
PREDICTED_PX = 7.0
"""Half diagonal of the mark at a predicted spot."""
_LINE = rr.Radius.ui_points(0.75)
_NO_DOT = rr.Radius.ui_points(0.0)
_SAME_PX = 0.01


def log_series_styles(stream: Stream, colors: Mapping[str, at.Rgb]) -> None:
    """Log name and colour of every laser's curve."""
    for quantity in QUANTITIES:
        for laser, color in colors.items():
            style = rr.SeriesPoints(colors=color, names=laser, markers="circle", marker_sizes=3.0)
            stream.log(at.under(at.SPOTS, quantity, laser), style, static=True)
    stream.log(at.AMBIENT, rr.SeriesLines(colors=at.WHITE, names="ambient"), static=True)


def log_scanlines(stream: Stream, lines: Mapping[str, FloatArray], colors: Mapping[str, at.Rgb]) -> None:
    """Log the line of each laser's spots in the picture, (2, 2) pixels."""
    strips = [line + RERUN_PIXEL_CENTRE for line in lines.values()]
    faint = [(*colors[laser], 60) for laser in lines]
    stream.log(at.SCANLINES, rr.LineStrips2D(strips, colors=faint, radii=_LINE if strips else None))


def as_png(content: bytes) -> tuple[bytes, Image]:
    """PNG file of a stored frame, the content itself where it is one, and its grey image, (height, width).

    Raises:
        BadInputError: OpenCV cannot read it.
    """
    flags = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    if image is None:
        raise BadInputError("a frame of the recording is no picture that OpenCV reads")
    grey = image.astype(np.uint8) if image.dtype == np.uint8 else image.astype(np.uint16)
    is_png = content.startswith(PNG_SIGNATURE)
    return (content if is_png else cv2.imencode(".png", grey)[1].tobytes()), grey


def log_frame(stream: Stream, png: bytes, ambient_dn: float | None, full_scale: int) -> None:
    """Log a frame with the lasers on, as stored; its contrast follows the room light.

    Args:
        stream: recording.
        png: the stored frame.
        ambient_dn: `median_dn` of the frame with the lasers off; None for a frame in room light.
        full_scale: largest value of a pixel.
    """
    shown = [0.0, white_level(ambient_dn, full_scale)]
    stream.log(
        at.IMAGE,
        rr.EncodedDepthImage(png, media_type="image/png", colormap="grayscale", depth_range=shown),
    )


def log_image(stream: Stream, on: Image, off: Image, full_scale: int) -> None:
    """Log a frame that is not stored, with the frame with the lasers off."""
    log_frame(stream, cv2.imencode(".png", on)[1].tobytes(), median_dn(off), full_scale)


def log_ambient(stream: Stream, ambient_dn: float) -> None:
    """Log the room light: the median of a frame with the lasers off, DN."""
    stream.log(at.AMBIENT, rr.Scalars(ambient_dn))


def median_dn(frame: Image) -> float:
    """Median of a frame (height, width), DN, from every eighth row and column."""
    return float(np.median(frame[::SAMPLED, ::SAMPLED]))


def white_level(ambient_dn: float | None, full_scale: int) -> float:
    """Value that is shown as white, as Rerun takes it: of 8 bits a share of full scale, of 16 bits in DN."""
    lit = None if ambient_dn is None else ambient_dn / full_scale / AMBIENT_SHARE
    white = 1.0 if lit is None else min(1.0, max(LEAST_WHITE, lit))
    return white if full_scale <= 255 else white * full_scale


def log_predicted(stream: Stream, spots: Mapping[str, FloatArray], colors: Mapping[str, at.Rgb]) -> None:
    """Log where spots are expected: a thin diamond around each, (2,) pixels."""
    turn = PREDICTED_PX * np.array([(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)])
    strips = [turn + spot + RERUN_PIXEL_CENTRE for spot in spots.values()]
    faint = [(*colors[laser], 110) for laser in spots]
    stream.log(at.PREDICTED_SPOTS, rr.LineStrips2D(strips, colors=faint, radii=_LINE if strips else None))


def log_predicted_ellipses(
    stream: Stream, outlines: Mapping[str, FloatArray], colors: Mapping[str, at.Rgb]
) -> None:
    """Log the outline (N, 2), px, of the uncertainty of each expected spot."""
    strips = [outline + RERUN_PIXEL_CENTRE for outline in outlines.values()]
    faint = [(*colors[laser], 110) for laser in outlines]
    stream.log(at.PREDICTED_ELLIPSES, rr.LineStrips2D(strips, colors=faint, radii=_LINE if strips else None))


def log_spots(stream: Stream, spots: Sequence[Spot], colors: Mapping[str, at.Rgb], height_px: int) -> None:
    """Log the spots of one capture, as marks in the picture and as numbers for curves.

    Args:
        stream: recording.
        spots: spots as found.
        colors: colours by laser.
        height_px: height of the frame; the label of a spot near its lower edge is above the spot.
    """
    _draw(stream, spots, colors, height_px)
    _log_curves(stream, spots)
    if spots:
        stream.log(at.SPOTS_RECORD, rr.AnyValues(drop_untyped_nones=True, **_record(spots)))


def _log_curves(stream: Stream, spots: Sequence[Spot]) -> None:
    by_laser: dict[str | None, list[Spot]] = defaultdict(list)
    for spot in spots:
        by_laser[spot.laser_id].append(spot)
    for laser, found in by_laser.items():
        for quantity in QUANTITIES:
            values = [getattr(spot, quantity) for spot in found]
            stream.log(_curve(quantity, laser), rr.Scalars(values))


def _record(spots: Sequence[Spot]) -> dict[str, list[float] | list[str]]:
    """All spots of a capture, a list for each quantity."""
    values = {name: [getattr(spot, name) for spot in spots] for name in RECORDED}
    numbers = {name: [nan if one is None else float(one) for one in ones] for name, ones in values.items()}
    return {
        **numbers,
        "laser_id": [spot.laser_id or "" for spot in spots],
        "flags": [" ".join(sorted(spot.flags)) for spot in spots],
    }


def log_assigned(
    stream: Stream,
    found: Sequence[Spot],
    spots: Sequence[Spot],
    colors: Mapping[str, at.Rgb],
    height_px: int,
) -> None:
    """Draw the spots of a frame again, and log the curves of those that a reading has assigned to lasers.

    Args:
        stream: recording.
        found: spots as found, already logged.
        spots: the same spots with the lasers of the reading.
        colors: colours by laser.
        height_px: height of the frame.
    """
    _draw(stream, spots, colors, height_px)
    _log_curves(stream, [new for old, new in zip(found, spots, strict=True) if new != old])


def assigned(spots: Sequence[Spot], lasers: Sequence[LaserRange]) -> list[Spot]:
    """The spots with the lasers whose ranges come from them."""
    return [replace(spot, laser_id=_assigned_laser(spot, lasers)) for spot in spots]


def _assigned_laser(spot: Spot, lasers: Sequence[LaserRange]) -> str | None:
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


def _draw(stream: Stream, spots: Sequence[Spot], colors: Mapping[str, at.Rgb], height_px: int) -> None:
    """Lines from each spot to a label below it, or above it near the lower edge; labels do not overlap."""
    ordered = sorted(spots, key=lambda spot: spot.u_px)
    columns = label_columns([spot.u_px for spot in ordered])
    leaders = [leader(spot, column, height_px) for spot, column in zip(ordered, columns, strict=True)]
    drawn = at.packed([colors.get(spot.laser_id or at.UNASSIGNED, at.WHITE) for spot in ordered])
    lines = [[(u + RERUN_PIXEL_CENTRE, v + RERUN_PIXEL_CENTRE) for u, v in leader] for leader in leaders]
    stream.log(
        at.SPOTS_IN_IMAGE,
        rr.LineStrips2D(lines, colors=drawn, radii=_LINE if lines else None),
        rr.Points2D(
            [line[-1] for line in lines],
            colors=drawn,
            labels=[label(spot) for spot in ordered],
            show_labels=True,
            radii=_NO_DOT if lines else None,
        ),
    )


def leader(spot: Spot, column_px: float, height_px: int) -> list[tuple[float, float]]:
    """Points of the line from a spot to its label in a column: down, or up where the frame ends below."""
    near, far = LEADER_PX
    way = 1.0 if spot.v_px + far + LABEL_HEIGHT_PX <= height_px else -1.0
    return [
        (spot.u_px, spot.v_px + way * near),
        (spot.u_px, spot.v_px + way * far / 2),
        (column_px, spot.v_px + way * far),
    ]


def label_columns(columns: Sequence[float]) -> list[float]:
    """Columns of labels for ascending columns of spots, at least `LABEL_DISTANCE_PX` apart, near their spots.

    Labels that would overlap are spread about the middle of their spots.
    """
    groups: list[list[float]] = []
    for column in columns:
        groups.append([column])
        while len(groups) > 1 and _left(groups[-1]) - _right(groups[-2]) < LABEL_DISTANCE_PX:
            groups[-2:] = [groups[-2] + groups[-1]]
    return [_left(group) + n * LABEL_DISTANCE_PX for group in groups for n in range(len(group))]


def _left(group: Sequence[float]) -> float:
    return sum(group) / len(group) - LABEL_DISTANCE_PX * (len(group) - 1) / 2


def _right(group: Sequence[float]) -> float:
    return _left(group) + LABEL_DISTANCE_PX * (len(group) - 1)


def label(spot: Spot) -> str:
    """Laser and flags of a spot."""
    flags = f" ({', '.join(sorted(spot.flags))})" if spot.flags else ""
    return f"{spot.laser_id or '?'}{flags}"
