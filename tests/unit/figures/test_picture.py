"""Pictures of charts for the viewer: where x is, what is shaded, nothing cut."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.text import Text
from numpy.typing import NDArray

from tests.viewer.session import BAD, a_fit
from workbench.figures.figure import draw
from workbench.figures.picture import DPI, SIZE_PX, Picture, note, picture
from workbench.figures.plot_style import own_style
from workbench.model.chart import Axis, Chart, LimitLine, Series, laser_colors
from workbench.model.fit_charts import residual_chart

COLORS = laser_colors(("L1", "L2", "L3", "L4"))
STANDOFFS = (125.0, 160.0, 210.0, 280.0, 400.0, 600.0, 900.0, 1400.0, 2200.0, 3200.0, 4500.0)


def a_chart(*x: float, scale: Literal["linear", "log"] = "log", **parts: object) -> Chart:
    series = tuple(
        Series(name=laser, x=x, y=tuple(0.1 * (-1) ** i for i in range(len(x))), sd=(0.05,) * len(x))
        for laser in COLORS
    )
    axes = {"x": Axis(label="standoff", unit="mm", scale=scale), "y": Axis(label="residual u", unit="px")}
    return Chart.model_validate({"name": "c", "title": "C", "series": series} | axes | parts)


def pixels(png: bytes) -> NDArray[np.uint8]:
    """(height, width, 3) BGR."""
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image.astype(np.uint8)


def reddish(drawn: Picture) -> NDArray[np.bool_]:
    """(height, width) whether red exceeds both other colours by more than a shade."""
    blue, green, red = np.moveaxis(pixels(drawn.png).astype(int), 2, 0)
    return np.asarray(red - np.maximum(green, blue) > 15)


@settings(max_examples=6)
@given(
    xs=st.lists(st.floats(50.0, 5000.0), min_size=1, max_size=12, unique_by=lambda x: round(x, 1)),
    scale=st.sampled_from(["linear", "log"]),
)
def test_every_x_has_its_column_in_the_axes_and_increasing(
    xs: list[float], scale: Literal["linear", "log"]
) -> None:
    drawn = picture(a_chart(*sorted(xs), scale=scale), COLORS)
    assert list(drawn.x_px) == sorted(xs)
    columns = list(drawn.x_px.values())
    assert columns == sorted(columns)
    assert min(columns) > 0
    assert max(columns) < drawn.width_px
    assert 0 < drawn.top_px < drawn.bottom_px < drawn.height_px


def test_columns_are_where_the_points_are_drawn() -> None:
    """A single series in a colour that nothing else has."""
    one = Series(name="a", x=(200.0, 700.0, 3000.0), y=(0.1, 0.2, -0.3), color="#ff00ff")
    drawn = picture(a_chart(series=(one,)), {})
    assert pixels(drawn.png).shape == (drawn.height_px, drawn.width_px, 3)
    magenta = (pixels(drawn.png) == (255, 0, 255)).all(axis=2)
    rows, columns = np.nonzero(magenta)
    for column in drawn.x_px.values():
        near = np.abs(columns - column) < 8
        assert near.sum() > 10
        assert np.mean(columns[near]) + 0.5 == pytest.approx(column, abs=1.0)
        assert drawn.top_px < rows[near].min() <= rows[near].max() < drawn.bottom_px


def test_flagged_values_have_a_shaded_column_and_others_none() -> None:
    flagged = (210.0, 1400.0)
    plain = a_chart(*STANDOFFS)
    drawn = picture(plain.model_copy(update={"flagged_x": flagged}), COLORS)
    inside = slice(round(drawn.top_px) + 3, round(drawn.bottom_px) - 3)
    share = reddish(drawn)[inside].mean(axis=0) - reddish(picture(plain, COLORS))[inside].mean(axis=0)
    for x, column in drawn.x_px.items():
        shaded = share[round(column) - 3 : round(column) + 4].max()
        assert (shaded > 0.5) == (x in flagged), x


def test_the_worst_placement_of_a_fit_is_shaded() -> None:
    drawn = picture(residual_chart(a_fit(), "u"), COLORS)
    column = round(drawn.x_px[BAD[1]])
    inside = slice(round(drawn.top_px) + 3, round(drawn.bottom_px) - 3)
    assert reddish(drawn)[inside, column - 5].mean() > 0.5


def test_equal_charts_give_equal_bytes_and_others_do_not() -> None:
    first, again = (picture(a_chart(*STANDOFFS), COLORS) for _ in range(2))
    assert first == again
    assert picture(a_chart(*STANDOFFS[1:]), COLORS).png != first.png
    assert picture(a_chart(*STANDOFFS), {**COLORS, "L1": "#ffffff"}).png != first.png


def test_a_picture_has_the_size_asked_for() -> None:
    drawn = picture(a_chart(*STANDOFFS), COLORS, (640, 300))
    assert pixels(drawn.png).shape == (300, 640, 3)
    assert (drawn.width_px, drawn.height_px) == (640, 300)


def test_a_note_is_one_line_of_light_text_in_the_middle() -> None:
    text = note("no fit yet")
    assert note("no fit yet") == text != note("no reading yet")
    light = pixels(text).max(axis=2) > 150
    assert light.shape == SIZE_PX[::-1]
    rows, columns = np.nonzero(light)
    assert np.mean(columns) == pytest.approx(SIZE_PX[0] / 2, abs=10)
    assert np.mean(rows) == pytest.approx(SIZE_PX[1] / 2, abs=10)


@pytest.mark.parametrize("size_px", [SIZE_PX, (900, 330)])
@pytest.mark.parametrize(
    "chart",
    [
        a_chart(*STANDOFFS),
        a_chart(*STANDOFFS, limits=(LimitLine(name="maximum permissible error", y=0.4),)),
        a_chart(*STANDOFFS, caption="a reading is the mean of the lasers; u: standard uncertainty"),
        residual_chart(a_fit(), "u"),
    ],
)
def test_labels_and_legend_are_complete_and_apart(chart: Chart, size_px: tuple[int, int]) -> None:
    with own_style(dark=True):
        figure = draw(chart, COLORS, (size_px[0] / DPI, size_px[1] / DPI))
        figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    boxes = [text.get_window_extent() for text in texts]
    for box in boxes:
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1
    for i, one in enumerate(boxes):
        assert not any(one.overlaps(other) for other in boxes[:i])
    shown = [text.get_text().strip() for text in texts]
    assert {f"{x:g}" for x in chart.x_values()} <= set(shown)
    names = {series.name for series in chart.series} | {limit.name for limit in chart.limits}
    assert {chart.title, chart.y.text, *names} <= set(shown)
    assert any(text.splitlines()[0] == chart.x.text for text in shown)
