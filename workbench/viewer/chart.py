"""A chart against standoff, drawn with lines and points in a 2D view.

Rerun plots against time only. Residuals against standoff are not a course of time: drawn, they stay visible
wherever the time cursor stands after the fit. x is logarithmic, because a bench's standoffs are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10

import rerun as rr

from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

WIDTH, HEIGHT = 1000.0, 420.0
BOUNDS_X, BOUNDS_Y = (-110.0, 1040.0), (-60.0, 490.0)
"""What a view of a chart shows: the plot, room for the tick labels, and the legend above."""
OUTLIER_SIGMA = 3.0
_DODGE = 7.0
"""Sideways shift from one series to the next, so that their bars do not cover each other."""
_MIN_TICK_DISTANCE = 55.0
_LABEL_RISE = 17.0
"""The viewer hangs a label below its point; raised by this, it stands beside a line of the grid."""
_LEGEND_Y = -42.0
_THIN = rr.Radius.ui_points(0.7)
_BAR = rr.Radius.ui_points(1.2)
_DOT = rr.Radius.ui_points(4.0)
_RING = rr.Radius.ui_points(8.0)
_NONE = rr.Radius.ui_points(0.0)
_GRID: at.Rgb = (70, 70, 75)

Strip = list[tuple[float, float]]


@dataclass(frozen=True)
class Mark:
    """One point of a chart with its standard deviation (1 sigma, unit of y), None where it is not known."""

    series: str
    standoff_mm: float
    y: float
    sd: float | None
    """Drawn as a bar."""
    expected_sd: float | None = None
    """Of y itself, with everything that moves it, by which outliers are told; None where it is not known."""

    @property
    def sigmas(self) -> float:
        """Distance from zero in standard deviations, 0 where they are not known."""
        return abs(self.y) / self.expected_sd if self.expected_sd else 0.0

    @property
    def is_outlier(self) -> bool:
        """Farther from zero than its standard deviation explains."""
        return self.sigmas > OUTLIER_SIGMA


@dataclass(frozen=True)
class Chart:
    """Marks, and the scales that bring them onto the plot."""

    unit: str
    marks: Sequence[Mark]
    colors: Mapping[str, at.Rgb]
    """Series in the order of the legend, with their colours."""

    @property
    def series(self) -> dict[str, at.Rgb]:
        """Series with their colours; one that nobody gave a colour to is white."""
        return {**self.colors, **{m.series: at.WHITE for m in self.marks if m.series not in self.colors}}

    @property
    def standoffs(self) -> list[float]:
        """Standoffs with a mark, ascending."""
        return sorted({mark.standoff_mm for mark in self.marks})

    @property
    def y_limit(self) -> float:
        """Half height of the plot, in the unit of y."""
        return 1.1 * max((abs(mark.y) + (mark.sd or 0.0) for mark in self.marks), default=1.0) or 1.0

    def x(self, standoff_mm: float) -> float:
        """Place of a standoff along the plot; a single standoff stands in the middle."""
        low, high = log10(self.standoffs[0]), log10(self.standoffs[-1])
        share = 0.5 if high == low else (log10(standoff_mm) - low) / (high - low)
        return WIDTH * (0.05 + 0.9 * share)

    def y(self, value: float) -> float:
        """Place of a value; y grows downwards in a picture."""
        return HEIGHT * (0.5 - 0.5 * value / self.y_limit)

    def place(self, mark: Mark) -> tuple[float, float]:
        """Where a mark is drawn."""
        series = list(self.series)
        shift = (series.index(mark.series) - (len(series) - 1) / 2) * _DODGE
        return (self.x(mark.standoff_mm) + shift, self.y(mark.y))


def log_chart(stream: Stream, entity: str, chart: Chart, empty: str) -> None:
    """Draw a chart at `entity`, in place of the one before; without marks it says `empty`."""
    stream.log(entity, rr.Clear(recursive=True))
    if not chart.marks:
        note = rr.Points2D([(WIDTH / 2, HEIGHT / 2)], labels=[empty], colors=at.WHITE, radii=_NONE)
        stream.log(f"{entity}/note", note)
        return
    _log_axes(stream, entity, chart)
    for position, series in enumerate(chart.series):
        _log_series(stream, at.under(f"{entity}/series", series), chart, series, position)
    _log_outliers(stream, f"{entity}/outliers", chart)


def _log_axes(stream: Stream, entity: str, chart: Chart) -> None:
    values = y_ticks(chart.y_limit)
    columns = _thinned([(chart.x(standoff), standoff) for standoff in chart.standoffs])
    rows: list[Strip] = [[(0.0, chart.y(value)), (WIDTH, chart.y(value))] for value in values]
    lines: list[Strip] = [[(chart.x(s), 0.0), (chart.x(s), HEIGHT)] for s in chart.standoffs]
    colors = [at.GREY if value == 0 else _GRID for value in values] + [_GRID] * len(lines)
    stream.log(f"{entity}/grid", rr.LineStrips2D(rows + lines, colors=colors, radii=_THIN, draw_order=-10.0))
    places = [(-55.0, chart.y(value) - _LABEL_RISE) for value in values] + [
        (x, HEIGHT + 10.0) for x, _ in columns
    ]
    texts = [f"{value:+.3g} {chart.unit}" if value else "0" for value in values]
    texts += [f"{standoff:g}" for _, standoff in columns]
    labels = rr.Points2D(places, labels=texts, colors=at.GREY, radii=_NONE, show_labels=True)
    stream.log(f"{entity}/ticks", labels)


def _log_series(stream: Stream, entity: str, chart: Chart, series: str, position: int) -> None:
    color = chart.series[series]
    marks = [mark for mark in chart.marks if mark.series == series]
    legend = (40.0 + 130.0 * position, _LEGEND_Y)
    labels = [series] + [""] * len(marks)
    points = [legend, *(chart.place(mark) for mark in marks)]
    stream.log(entity, rr.Points2D(points, colors=color, radii=_DOT, labels=labels, show_labels=True))
    bars = [_bar(chart, mark) for mark in marks if mark.sd is not None]
    if bars:
        stream.log(f"{entity}/one_sigma", rr.LineStrips2D(bars, colors=color, radii=_BAR))


def _bar(chart: Chart, mark: Mark) -> Strip:
    x, _ = chart.place(mark)
    sd = mark.sd or 0.0
    return [(x, chart.y(mark.y - sd)), (x, chart.y(mark.y + sd))]


def _log_outliers(stream: Stream, entity: str, chart: Chart) -> None:
    """Red rings around what the standard deviation does not explain: a bad standoff is seen at once."""
    marks = [mark for mark in chart.marks if mark.is_outlier]
    if not marks:
        return
    worst = {mark.standoff_mm: mark for mark in sorted(marks, key=lambda mark: mark.sigmas)}
    # One label a standoff: with more of them none can be read.
    labels = [_outlier(mark) if mark is worst[mark.standoff_mm] else "" for mark in marks]
    places = [chart.place(mark) for mark in marks]
    rings = rr.Points2D(places, colors=at.RED, radii=_RING, labels=labels, show_labels=True, draw_order=-5.0)
    stream.log(entity, rings)


def _outlier(mark: Mark) -> str:
    return f"{mark.series} at {mark.standoff_mm:g} mm: {mark.sigmas:.1f} sigma"


def y_ticks(limit: float) -> list[float]:
    """Round values from -limit to limit with zero among them, three to nine."""
    power = 10.0 ** floor(log10(limit / 2))
    step = next(power * factor for factor in (5.0, 2.0, 1.0) if power * factor <= limit / 2)
    count = floor(limit / step)
    return [round(i * step, 12) for i in range(-count, count + 1)]


def _thinned(columns: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Tick labels that have room, from the left."""
    kept: list[tuple[float, float]] = []
    for column in columns:
        if not kept or column[0] - kept[-1][0] >= _MIN_TICK_DISTANCE:
            kept.append(column)
    return kept
