"""Pictures of charts in a recording, and the frame around the present value."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.viewer_stream import COLORS, HERE, logged
from workbench.figures.picture import Picture, note, picture
from workbench.model.chart import Axis, Chart, Series
from workbench.viewer.chart import CURSOR_HALF_PX, log_chart, log_cursor, log_note
from workbench.viewer.entities import to_hex
from workbench.viewer.stream import Moment, Stream

IMAGE, BLOB, STRIPS = "/c/image", "EncodedImage:blob", "LineStrips2D:strips"
CHART = Chart(
    name="c",
    title="C",
    x=Axis(label="standoff", unit="mm", scale="log"),
    y=Axis(label="error", unit="%"),
    series=(Series(name="L1", x=(200.0, 900.0, 4000.0), y=(0.1, -0.2, 0.3)),),
)
DRAWN = Picture(b"", 1100, 400, {200.0: 150.0, 900.0: 400.5}, 30.0, 310.0)


def test_a_chart_is_a_static_picture_with_the_lasers_colours(tmp_path: Path) -> None:
    kept: list[Picture | None] = []
    contents = logged(
        tmp_path, lambda stream: kept.append(log_chart(stream, "c", CHART, COLORS, "no points"))
    )
    drawn = picture(CHART, {name: to_hex(color) for name, color in COLORS.items()})
    assert kept == [drawn]
    assert contents.static(IMAGE, BLOB) == [drawn.png]


def test_a_chart_without_points_is_a_note(tmp_path: Path) -> None:
    gap = CHART.model_copy(update={"series": (Series(name="L1", x=(200.0,), y=(None,)),)})
    kept: list[Picture | None] = []
    contents = logged(tmp_path, lambda stream: kept.append(log_chart(stream, "c", gap, COLORS, "no points")))
    assert kept == [None]
    assert contents.static(IMAGE, BLOB) == [note("no points")]


def test_the_last_picture_is_shown_at_every_time(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        log_note(stream, "c", "not yet")
        stream.at(Moment(5, 2, HERE.time_ns + 5, 700.0))
        log_chart(stream, "c", CHART, COLORS, "")

    contents = logged(tmp_path, log)
    assert len(contents.static(IMAGE, BLOB)) == 2
    shown = [contents.shown(IMAGE, BLOB, line, at) for line, at in (("capture", 1), ("standoff_mm", 9000))]
    assert shown == [contents.static(IMAGE, BLOB)[-1]] * 2


@pytest.mark.parametrize("x", DRAWN.x_px)
def test_the_frame_is_about_the_column_of_its_value_over_the_height_of_the_axes(
    tmp_path: Path, x: float
) -> None:
    contents = logged(tmp_path, lambda stream: log_cursor(stream, "c", DRAWN, x))
    ((_, (strip,)),) = contents.values("/c/cursor", STRIPS)
    us, vs = zip(*strip, strict=True)
    assert (min(us), max(us)) == (DRAWN.x_px[x] - CURSOR_HALF_PX, DRAWN.x_px[x] + CURSOR_HALF_PX)
    assert (min(vs), max(vs)) == (DRAWN.top_px, DRAWN.bottom_px)
    assert strip[0] == strip[-1]


@pytest.mark.parametrize("x", [None, 901.0])
def test_without_a_value_in_the_chart_the_frame_is_removed(tmp_path: Path, x: float | None) -> None:
    def log(stream: Stream) -> None:
        log_cursor(stream, "c", DRAWN, 200.0)
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        log_cursor(stream, "c", DRAWN, x)

    contents = logged(tmp_path, log)
    assert contents.shown("/c/cursor", STRIPS, "capture", 1) != []
    assert contents.shown("/c/cursor", STRIPS, "capture", 2) == []
