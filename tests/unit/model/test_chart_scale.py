"""Ends and ticks of a chart's axes."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.model.chart import Axis, Chart, LimitLine, Series
from workbench.model.chart_scale import (
    MARGIN,
    MOST_LABELLED,
    linear_ticks,
    tick_texts,
    x_scale,
    x_ticks,
    y_scale,
)


def chart(
    x: tuple[float, ...],
    y: tuple[float, ...],
    scale: Literal["linear", "log"] = "linear",
    limits: tuple[float, float] | None = None,
) -> Chart:
    series = Series(name="a", x=x, y=y)
    axis = Axis(label="x", scale=scale, limits=limits)
    return Chart(name="c", title="C", x=axis, y=Axis(label="y"), series=(series,))


@given(
    values=st.lists(st.floats(10.0, 1e4), min_size=1, max_size=40), scale=st.sampled_from(["linear", "log"])
)
def test_every_value_lies_inside_and_labels_keep_their_distance(
    values: list[float], scale: Literal["linear", "log"]
) -> None:
    one = chart(tuple(values), tuple(values), scale)
    x = x_scale(one)
    assert all(0 < x.share(value) < 1 for value in values)
    above, below = ([x.share(tick) for tick in row] for row in x_ticks(one, x, 0.055))
    for row in (above, below):
        # Two alone may be nearer: the first and the last.
        assert len(row) <= 2 or all(b - a >= 0.055 - 1e-9 for a, b in pairwise(row))
    if above and len(set(values)) <= MOST_LABELLED:
        assert (above[0], above[-1]) == (x.share(min(values)), x.share(max(values)))


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_standoffs_without_room_are_labelled_in_a_second_row(scale: Literal["linear", "log"]) -> None:
    standoffs = (200.0, 210.0, 500.0, 1250.0, 1900.0, 1950.0, 2000.0)
    one = chart(standoffs, standoffs, scale)
    above, below = x_ticks(one, x_scale(one), 0.07)
    assert above == [200.0, 500.0, 1250.0, 2000.0]
    assert below == [210.0, 1950.0]


def test_values_of_two_rows_at_nearly_one_place_leave_room_for_their_neighbours() -> None:
    """True ranges of two inclines at each standoff, as in the thesis's trials."""
    pairs = (124.6, 124.8, 599.6, 599.8, 699.6, 699.8, 799.6, 799.8, 999.6, 999.8)
    one = chart(pairs, pairs, "log")
    above, below = x_ticks(one, x_scale(one), 0.07)
    assert sorted([*above, *below]) == [124.6, 599.6, 699.6, 799.6, 999.8]


def test_many_values_have_round_ticks() -> None:
    x = tuple(np.linspace(45.3, 4987.1, 100).tolist())
    one = chart(x, x)
    assert x_ticks(one, x_scale(one), 0.05) == ([0, 1000, 2000, 3000, 4000, 5000], [])
    logarithmic = chart(x, x, "log")
    assert x_ticks(logarithmic, x_scale(logarithmic), 0.05) == ([50, 100, 200, 500, 1000, 2000, 5000], [])


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_the_first_and_the_last_value_keep_the_margin(scale: Literal["linear", "log"]) -> None:
    x = x_scale(chart((10.0, 70.0, 1000.0), (1.0, 2.0, 3.0), scale))
    assert x.share(10.0) == pytest.approx(MARGIN)
    assert x.share(1000.0) == pytest.approx(1.0 - MARGIN)


def test_values_that_differ_by_rounding_stand_in_the_middle() -> None:
    x = x_scale(chart((10.0, np.nextafter(10.0, 11.0)), (1.0, 2.0)))
    assert x.share(10.0) == pytest.approx(0.5)


def test_a_single_value_stands_in_the_middle() -> None:
    for scale in ("linear", "log"):
        assert x_scale(chart((700.0,), (1.0,), scale)).share(700.0) == pytest.approx(0.5)


def test_errors_on_both_sides_of_zero_are_symmetric() -> None:
    y = y_scale(chart((1.0, 2.0), (-3.0, 1.0)))
    assert y.low == -y.high
    assert y.share(0.0) == 0.5
    assert y_scale(chart((1.0, 2.0), (2.0, 4.0))).low > 0


def test_limits_of_the_axis_come_first() -> None:
    x = x_scale(chart((1.0, 2000.0), (0.0, 1.0), limits=(0.0, 500.0)))
    assert (x.low, x.high) == (0.0, 500.0)


def test_a_limit_far_out_is_on_the_chart() -> None:
    one = chart((1.0, 2.0), (-1.0, 1.0)).model_copy(update={"limits": (LimitLine(name="MPE", y=20.0),)})
    assert y_scale(one).high > 20.0


@pytest.mark.parametrize(("low", "high"), [(0, 5000), (-0.06, 0.06), (-0.1, 0.2), (3.2, 3.9), (0, 120)])
def test_ticks_are_round_and_inside(low: float, high: float) -> None:
    found = linear_ticks(low, high)
    assert 3 <= len(found) <= 10
    assert low - 1e-9 <= found[0] <= found[-1] <= high + 1e-9
    assert np.allclose(np.diff(found), found[1] - found[0])


@given(limit=st.floats(1e-6, 1e6))
def test_ticks_about_zero_have_it(limit: float) -> None:
    ticks = linear_ticks(-limit, limit)
    assert 3 <= len(ticks) <= 11
    assert 0.0 in ticks


@pytest.mark.parametrize(
    ("low", "high"), [(300.0, 339.0), (3.0, 4.0), (1.5, 1.6), (9.0, 11.0), (80.0, 400.0)]
)
def test_a_short_logarithmic_axis_has_ticks_inside(low: float, high: float) -> None:
    x = tuple(np.linspace(low, high, 40).tolist())
    one = chart(x, x, "log")
    log = Axis(label="y", scale="log")
    scale = x_scale(one)
    (above, below), y = x_ticks(one, scale, 0.05), y_scale(one.model_copy(update={"y": log})).round_ticks()
    assert below == []
    for ticks in (above, y):
        assert len(ticks) >= 2
        assert all(scale.low * (1 - 1e-9) <= tick <= scale.high * (1 + 1e-9) for tick in ticks)


@pytest.mark.parametrize(
    ("ticks", "texts"),
    [
        ([124.598, 999.833], ["124.6", "999.8"]),
        ([20261.0, 20262.0], ["20261", "20262"]),
        ([12500.0, -0.5, 0.0], ["12500", "-0.5", "0"]),
        ([], []),
    ],
)
def test_labels_of_ticks_have_as_few_digits_as_distinguish_them(ticks: list[float], texts: list[str]) -> None:
    assert tick_texts(ticks) == texts
