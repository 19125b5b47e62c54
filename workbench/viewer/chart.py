"""Charts as pictures, with a frame around the values that the time cursor is at.

Rerun plots only against time. Charts over standoffs are therefore pictures. They are static, so that they are
visible wherever the time cursor is; only the frame moves.
"""

from __future__ import annotations

from collections.abc import Mapping

import rerun as rr

from workbench.figures.picture import SIZE_PX, Picture, note, picture
from workbench.model.chart import Chart
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

CURSOR_HALF_PX = 17.0
_FRAME = rr.Radius.ui_points(1.0)


def log_chart(
    stream: Stream,
    entity: str,
    chart: Chart,
    colors: Mapping[str, at.Rgb],
    empty: str,
    size_px: tuple[int, int] = SIZE_PX,
) -> Picture | None:
    """Log the picture of a chart, or a note where it has no points; returns the picture of a chart.

    Args:
        stream: recording.
        entity: entity of the picture; the frame around the present value is below it.
        chart: the chart.
        colors: colours by name of series.
        empty: note for a chart without points.
        size_px: width and height of the picture.
    """
    if chart.is_empty:
        log_note(stream, entity, empty, size_px)
        return None
    drawn = picture(chart, {name: at.to_hex(color) for name, color in colors.items()}, size_px)
    _log(stream, entity, drawn.png)
    return drawn


def log_note(stream: Stream, entity: str, text: str, size_px: tuple[int, int] = SIZE_PX) -> None:
    """Log a text in place of a chart."""
    _log(stream, entity, note(text, size_px))


def log_cursor(stream: Stream, entity: str, drawn: Picture, x: float | None) -> None:
    """Log the frame around the points at one x, from the present position on the timelines on; None: none."""
    column = None if x is None else drawn.x_px.get(x)
    if column is None:
        stream.log(f"{entity}/cursor", rr.LineStrips2D([]))
        return
    left, right = column - CURSOR_HALF_PX, column + CURSOR_HALF_PX
    top, bottom = drawn.top_px, drawn.bottom_px
    corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    stream.log(f"{entity}/cursor", rr.LineStrips2D([corners], colors=at.WHITE, radii=_FRAME))


def _log(stream: Stream, entity: str, png: bytes) -> None:
    image = rr.EncodedImage(contents=png, media_type="image/png", magnification_filter="linear")
    stream.log(f"{entity}/image", image, static=True)
