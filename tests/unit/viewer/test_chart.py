"""Places of a chart's marks in its view."""

from __future__ import annotations

from itertools import pairwise
from math import dist
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.model.chart import Axis, Chart, Series
from workbench.viewer.chart import BOUNDS_Y, HEIGHT, WIDTH, Plot, dashes, legend_points

NAMES = ("L1", "L2", "L3")


def chart(*series: Series, scale: Literal["linear", "log"] = "log", **y: object) -> Chart:
    return Chart(
        name="c",
        title="C",
        x=Axis(label="standoff", unit="mm", scale=scale),
        y=Axis.model_validate({"label": "error", "unit": "%"} | y),
        series=series,
    )


def series(name: str, points: list[tuple[float, float, float | None]]) -> Series:
    return Series(
        name=name,
        x=tuple(p[0] for p in points),
        y=tuple(p[1] for p in points),
        sd=tuple(p[2] for p in points),
    )


POINTS = st.lists(
    st.tuples(st.floats(10.0, 1e4), st.floats(-1e3, 1e3), st.none() | st.floats(0.0, 1e3)), min_size=1
)


@given(points=st.lists(POINTS, min_size=1, max_size=3), scale=st.sampled_from(["linear", "log"]))
def test_every_mark_and_its_bar_lie_on_the_plot(
    points: list[list[tuple[float, float, float | None]]], scale: Literal["linear", "log"]
) -> None:
    plot = Plot.of(chart(*map(series, NAMES, points), scale=scale))
    for position, one in enumerate(plot.chart.series):
        for i in range(len(one.x)):
            for x, y in (plot.point(position, i), *plot.strip(position, i)):
                assert 0 < x < WIDTH
                assert 0 < y < HEIGHT


def test_larger_values_are_higher_and_farther_standoffs_to_the_right() -> None:
    plot = Plot.of(chart(series("L1", [(200.0, -1.0, 0.1), (2000.0, 1.0, 0.1)])))
    (x0, y0), (x1, y1) = plot.point(0, 0), plot.point(0, 1)
    assert x0 < x1
    assert y0 > y1
    low, high = plot.strip(0, 0)
    assert low[1] > y0 > high[1]
    assert low[0] == high[0] == x0


def test_series_of_points_stand_side_by_side_and_lines_do_not_move() -> None:
    one = series("L1", [(200.0, -1.0, None), (500.0, 1.0, None)])
    line = one.model_copy(update={"name": "model", "style": "line"})
    plot = Plot.of(chart(one, line, one.model_copy(update={"name": "L2"})))
    left, middle, right = (plot.point(position, 0)[0] for position in range(3))
    assert left < middle < right
    assert middle == pytest.approx(plot.at(200.0, 0.0)[0])


def test_what_lies_beyond_the_limits_is_drawn_on_the_edge() -> None:
    plot = Plot.of(chart(series("L1", [(200.0, 50.0, None), (500.0, 0.0, None)]), limits=(-1.0, 1.0)))
    assert plot.point(0, 0)[1] == 0.0


CHARACTER_WIDTH, ROW_HEIGHT = 13.0, 40.0
"""Size of a label's character in a view of usual size, plot units."""


@pytest.mark.parametrize(
    ("name", "count"), [("L1", 1), ("L1", 9), ("sensor", 9), ("workbench, noise, 30 deg", 4)]
)
def test_names_of_a_legend_do_not_overlap(name: str, count: int) -> None:
    names = [f"{name} {i}" for i in range(count)]
    points = legend_points(names)
    width = CHARACTER_WIDTH * max(map(len, names))
    for i, (x, y) in enumerate(points):
        assert x - width / 2 >= 0
        assert BOUNDS_Y[0] < y < 0
        for other_x, other_y in points[:i]:
            assert abs(x - other_x) >= width or abs(y - other_y) >= ROW_HEIGHT


def test_dashes_have_equal_lengths_and_gaps_along_a_line() -> None:
    line = [(0.0, 0.0), (30.0, 40.0), (30.0, 40.0), (30.0, 240.0)]
    cut = list(dashes(line))
    lengths = [dist(a, b) for a, b in cut]
    assert sum(lengths) == pytest.approx(250.0 * 14.0 / 23.0, abs=14.0)
    assert max(lengths) <= 14.0 + 1e-9
    assert cut[0][0] == (0.0, 0.0)
    gaps = [dist(a[1], b[0]) for a, b in pairwise(cut)]
    assert all(gap == pytest.approx(9.0) or gap == pytest.approx(0.0) for gap in gaps[3:])
    on_line = [
        x == pytest.approx(0.75 * y) if y < 40 else x == pytest.approx(30.0) for p in cut for x, y in p
    ]
    assert all(on_line)
