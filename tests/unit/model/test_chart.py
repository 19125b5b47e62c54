"""Charts as data: outliers, bars, what is drawn."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from workbench.model.chart import (
    PALETTE,
    Axis,
    Band,
    Chart,
    LimitLine,
    Series,
    laser_colors,
    series_colors,
)


def chart(*series: Series, bands: tuple[Band, ...] = (), limits: tuple[LimitLine, ...] = ()) -> Chart:
    x, y = Axis(label="standoff", unit="mm"), Axis(label="error", unit="%")
    return Chart(name="c", title="C", x=x, y=y, series=series, bands=bands, limits=limits)


@pytest.mark.parametrize(
    ("y", "sd", "outlier"),
    [(0.31, 0.1, True), (-0.31, 0.1, True), (0.29, 0.1, False), (9.0, None, False), (None, 0.1, False)],
)
def test_outliers_are_beyond_three_sigma(y: float | None, sd: float | None, outlier: bool) -> None:
    assert Series(name="L1", x=(500.0,), y=(y,), sd=(0.01,), expected_sd=(sd,)).is_outlier(0) is outlier


def test_nothing_is_an_outlier_without_expectation() -> None:
    assert not Series(name="L1", x=(500.0,), y=(1e6,), sd=(0.01,)).is_outlier(0)


def test_a_bar_is_one_sigma_to_each_side() -> None:
    one = Series(name="a", x=(1.0, 2.0, 3.0), y=(5.0, 5.0, None), sd=(2.0, None, 1.0))
    assert [one.bar(i) for i in range(3)] == [(3.0, 7.0), (5.0,), ()]
    assert Series(name="a", x=(1.0,), y=(5.0,)).bar(0) == (5.0,)


def test_everything_drawn_counts_for_the_axes() -> None:
    one = chart(
        Series(name="a", x=(3.0, 1.0, 9.0), y=(1.0, 2.0, None), sd=(0.5, None, None)),
        bands=(Band(name="b", x=(1.0, 5.0), low=(-4.0, -1.0), high=(4.0, 1.0)),),
        limits=(LimitLine(name="MPE", y=8.0),),
    )
    assert one.x_values() == [1.0, 3.0]
    assert one.y_values() == [-4.0, -1.0, 0.5, 1.0, 1.5, 2.0, 4.0, 8.0]


@pytest.mark.parametrize(
    ("y", "runs"),
    [
        ((), []),
        ((None, None), []),
        ((1.0, 2.0), [[0, 1]]),
        ((1.0, None, None, 2.0, 3.0, None, 4.0), [[0], [3, 4], [6]]),
        ((None, 1.0, None), [[1]]),
    ],
)
def test_runs_are_the_points_between_gaps(y: tuple[float | None, ...], runs: list[list[int]]) -> None:
    assert Series(name="s", x=tuple(map(float, range(len(y)))), y=y).runs() == runs


def test_a_chart_of_gaps_is_empty() -> None:
    assert chart().is_empty
    assert chart(Series(name="a", x=(1.0,), y=(None,))).is_empty
    assert not chart(Series(name="a", x=(1.0,), y=(0.0,))).is_empty


def test_a_number_that_is_not_finite_makes_a_gap() -> None:
    one = Series(name="a", x=(1.0, 2.0), y=(float("nan"), 1.0), sd=(0.1, float("inf")))
    assert (one.y, one.sd) == ((None, 1.0), (0.1, None))


def test_an_axis_has_its_unit() -> None:
    assert Axis(label="standoff", unit="mm").text == "standoff [mm]"
    assert Axis(label="share").text == "share"


@pytest.mark.parametrize(
    "values", [{"y": (1.0,)}, {"y": (1.0, 2.0), "sd": (1.0,)}, {"y": (1.0, 2.0), "expected_sd": (1.0,)}]
)
def test_lengths_of_a_series_agree(values: dict[str, tuple[float, ...]]) -> None:
    with pytest.raises(ValidationError):
        Series.model_validate({"name": "a", "x": (1.0, 2.0)} | values)


@pytest.mark.parametrize("limits", [(1.0, 1.0), (2.0, 1.0)])
def test_limits_of_an_axis_ascend(limits: tuple[float, float]) -> None:
    with pytest.raises(ValidationError):
        Axis(label="x", limits=limits)


def test_a_log_axis_begins_above_zero() -> None:
    assert Axis(label="x", limits=(0.0, 10.0)).limits == (0.0, 10.0)
    with pytest.raises(ValidationError):
        Axis(label="x", scale="log", limits=(0.0, 10.0))


@pytest.mark.parametrize(("low", "high"), [((0.0,), (1.0, 1.0)), ((0.0, 0.0), (1.0,)), ((0.0,), (1.0,))])
def test_lengths_of_a_band_agree(low: tuple[float, ...], high: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError):
        Band(name="b", x=(1.0, 2.0), low=low, high=high)


@pytest.mark.parametrize(
    ("axis", "part"), [("x", "series"), ("x", "bands"), ("y", "series"), ("y", "bands"), ("y", "limits")]
)
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_log_axis_has_no_value_up_to_zero(axis: str, value: float, part: str) -> None:
    x, y = (value, 5.0) if axis == "x" else (5.0, value)
    one = {
        "series": Series(name="s", x=(1.0, x), y=(1.0, y)),
        "bands": Band(name="b", x=(1.0, x), low=(1.0, y), high=(1.0, 9.0)),
        "limits": LimitLine(name="l", y=y),
    }[part]
    axes = {"x": Axis(label="x"), "y": Axis(label="y")}
    values = {"name": "c", "title": "C", "series": ()} | axes | {part: (one,)}
    Chart.model_validate(values)
    with pytest.raises(ValidationError):
        Chart.model_validate(values | {axis: Axis(label="log", scale="log")})


def test_a_bar_may_reach_below_a_log_axis() -> None:
    series = Series(name="s", x=(1.0,), y=(1.0,), sd=(2.0,))
    y = Axis(label="y", scale="log")
    assert Chart(name="c", title="C", x=Axis(label="x"), y=y, series=(series,)).y_values() == [-1.0, 3.0]


def named(*names: str, color: str = "") -> list[Series]:
    return [Series(name=name, x=(), y=(), color=color) for name in names]


def test_a_series_has_its_own_colour_or_its_laser_s_or_the_next_unused() -> None:
    lasers = laser_colors(("L1", "L2"))
    series = [*named("mean", "L2", "median"), *named("L1", color=PALETTE[2].upper()), *named("more")]
    chosen = series_colors(series, lasers)
    assert chosen == [PALETTE[0], PALETTE[1], PALETTE[3], PALETTE[2].upper(), PALETTE[4]]


def test_colours_repeat_after_the_palette() -> None:
    names = [str(i) for i in range(9)]
    assert series_colors(named(*names), {}) == [*PALETTE, *PALETTE[:2]]
    assert list(laser_colors(names).values()) == [*PALETTE, *PALETTE[:2]]
    assert series_colors(named(*names[:7], "else"), laser_colors(names[:7])) == [*PALETTE, PALETTE[0]]


@pytest.mark.parametrize("color", ["red", "#12345", "#1234567", "112233", "#11223g"])
def test_a_colour_is_six_hexadecimal_digits(color: str) -> None:
    with pytest.raises(ValidationError):
        Series(name="s", x=(), y=(), color=color)
