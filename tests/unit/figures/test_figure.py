"""Charts as SVG pictures."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest

from tests.viewer.session import a_fit
from workbench.figures.figure import draw, svg
from workbench.figures.plot_style import own_style
from workbench.model.chart import PALETTE, Axis, Band, Chart, LimitLine, Series, laser_colors
from workbench.model.fit_charts import residual_chart

LINE = Series(name="a & b", x=(0.0, 5.0, 6.0, 10.0), y=(1.0, None, -1.0, 0.0), style="line", color="#112233")
CHART = Chart(
    name="c",
    title="T",
    x=Axis(label="distance", unit="mm", limits=(0.0, 10.0)),
    y=Axis(label="error", unit="%", limits=(-1.0, 1.0)),
    series=(LINE, LINE.model_copy(update={"name": "other", "dashed": True})),
    caption="what it shows",
)


def strokes(picture: bytes, color: str) -> list[str]:
    """Path data of everything drawn with a colour."""
    root = ET.fromstring(picture)  # noqa: S314 - our own
    paths = [e for e in root.iter() if e.tag.endswith("path") and f"stroke: {color}" in e.get("style", "")]
    return [path.get("d", "") for path in paths]


def test_a_line_is_drawn_to_scale_with_its_gap() -> None:
    line, *_ = strokes(svg(CHART, {}), "#112233")
    commands = re.findall(r"([ML]) ([\d.]+) ([\d.]+)", line)
    assert [command for command, _, _ in commands] == ["M", "M", "L"]
    x, y = np.array([[float(a), float(b)] for _, a, b in commands]).T
    assert (x[1] - x[0]) / (x[2] - x[0]) == pytest.approx(0.6, abs=1e-4)
    assert (y[2] - y[0]) / (y[1] - y[0]) == pytest.approx(0.5, abs=1e-4)


def test_a_point_between_gaps_of_a_line_is_drawn_as_a_marker() -> None:
    (axes,) = draw(CHART.model_copy(update={"series": (LINE,)}), {}).axes
    markers = [line for line in axes.lines if line.get_marker() == "o"]
    assert [np.asarray(one.get_xydata()).tolist() for one in markers] == [[[0.0, 1.0]]]
    assert [one.get_color() for one in markers] == [LINE.color]


def test_a_line_of_one_point_is_drawn_as_a_marker() -> None:
    single = LINE.model_copy(update={"x": (4.0,), "y": (0.5,)})
    (axes,) = draw(CHART.model_copy(update={"series": (single,)}), {}).axes
    markers = [line for line in axes.lines if line.get_marker() == "o"]
    assert [np.asarray(one.get_xydata()).tolist() for one in markers] == [[[4.0, 0.5]]]


def test_the_same_chart_gives_the_same_bytes_whatever_the_user_s_style() -> None:
    first = svg(CHART, {})
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.fonttype": "none"}):
        assert svg(CHART, {}) == first
        assert mpl.rcParams["font.size"] == 30.0, "the caller's style is left alone"
    assert b"<dc:date>" not in first


def test_titles_units_legend_and_caption_are_on_it() -> None:
    figure = draw(CHART, {})
    (axes,) = figure.axes
    assert axes.get_title(loc="left") == "T"
    assert axes.get_xlabel().splitlines() == ["distance [mm]", "what it shows"]
    assert axes.get_ylabel() == "error [%]"
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["a & b", "other"]


def test_one_series_needs_no_legend() -> None:
    assert draw(CHART.model_copy(update={"series": (LINE,)}), {}).legends == []


def test_standoffs_are_labelled_on_a_logarithmic_axis_and_outliers_ringed() -> None:
    figure = draw(residual_chart(a_fit(), "u"), {})
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["200", "500", "1250", "3000"]
    rings = [line for line in axes.lines if line.get_fillstyle() == "none"]
    assert [np.asarray(ring.get_xydata()).tolist() for ring in rings] == [[[1250.0, 0.24]]]


def test_bands_and_limits_are_drawn_and_named() -> None:
    band = Band(name="tolerance", x=(0.0, 10.0), low=(-0.5, -0.2), high=(0.5, 0.2))
    figure = draw(CHART.model_copy(update={"bands": (band,), "limits": (LimitLine(name="MPE", y=0.8),)}), {})
    (legend,) = figure.legends
    assert {"tolerance", "MPE"} < {text.get_text() for text in legend.get_texts()}


@pytest.mark.parametrize("series", [1, 3, 8])
def test_nothing_is_drawn_over_anything_else_or_over_the_edge(series: int) -> None:
    many = tuple(LINE.model_copy(update={"name": f"workbench, noise, shift {i} mm"}) for i in range(series))
    with own_style():
        figure = draw(CHART.model_copy(update={"series": many}), {})
        figure.draw_without_rendering()
    (axes,) = figure.axes
    page = figure.bbox
    plot = axes.get_window_extent()
    boxes = [legend.get_window_extent() for legend in figure.legends]
    boxes += [axes.title.get_window_extent(), axes.xaxis.label.get_window_extent()]
    for box in boxes:
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1
        assert not box.overlaps(plot)
    for legend in figure.legends:
        assert not legend.get_window_extent().overlaps(axes.xaxis.label.get_window_extent())


def test_a_laser_has_its_colour_and_others_the_next_of_the_palette() -> None:
    lines = tuple(Series(name=name, x=(0.0, 1.0), y=(0.0, 1.0), style="line") for name in ("mean", "L2"))
    (axes,) = draw(CHART.model_copy(update={"series": lines}), laser_colors(("L1", "L2"))).axes
    drawn = {str(line.get_label()): line.get_color() for line in axes.lines}
    assert (drawn["mean"], drawn["L2"]) == PALETTE[:2]
