"""A chart drawn with lines and points in a 2D view.

Rerun plots against time only. Residuals against standoff are not a course of time: drawn, they stay visible
wherever the time cursor stands after the fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import rerun as rr

from workbench.model.chart import Chart, Series, series_colors
from workbench.model.chart_scale import Scale, x_scale, x_ticks, y_scale
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

WIDTH, HEIGHT = 1000.0, 420.0
BOUNDS_X, BOUNDS_Y = (-110.0, 1060.0), (-95.0, 550.0)
"""What a view of a chart shows: the plot, the tick labels, and the title and legend above."""
_DODGE = 7.0
"""Sideways shift from one series to the next, so that their bars do not cover each other."""
_LEAST_TICK_DISTANCE = 0.055
"""Of two labels of x, as a share of the plot's width."""
_LABEL_RISE = 17.0
"""The viewer hangs a label below its point; raised by this, it stands beside a line of the grid."""
_TITLE_Y, _LEGEND_Y, _X_LABEL_Y = -92.0, -42.0, HEIGHT + 84.0
_TICK_ROWS_Y = (HEIGHT + 10.0, HEIGHT + 46.0)
_LEGEND_STEP = 130.0
_THIN = rr.Radius.ui_points(0.7)
_BAR = rr.Radius.ui_points(1.2)
_DOT = rr.Radius.ui_points(4.0)
_RING = rr.Radius.ui_points(8.0)
_NONE = rr.Radius.ui_points(0.0)
_GRID: at.Rgb = (70, 70, 75)

Point = tuple[float, float]
Strip = list[Point]


@dataclass(frozen=True)
class Plot:
    """A chart with the scales that bring it onto the plot, `WIDTH` x `HEIGHT` with y down."""

    chart: Chart
    x: Scale
    y: Scale

    @classmethod
    def of(cls, chart: Chart) -> Plot:
        """The plot of a chart."""
        return cls(chart, x_scale(chart), y_scale(chart))

    def at(self, x: float, y: float) -> Point:
        """Place of a pair of values; what lies beyond the axes' limits is drawn on the plot's edge."""
        across, up = (min(max(share, 0.0), 1.0) for share in (self.x.share(x), self.y.share(y)))
        return WIDTH * across, HEIGHT * (1 - up)

    def strip(self, position: int, index: int) -> Strip:
        """A point of a series, or its bar of one sigma, aside of those of other series."""
        series = self.chart.series[position]
        places = [self.at(series.x[index], y) for y in series.bar(index)]
        return [(x + self._shift(position), y) for x, y in places]

    def point(self, position: int, index: int) -> Point:
        """Place of a point of a series; the series must have it."""
        series = self.chart.series[position]
        x, y = self.at(series.x[index], series.y[index] or 0.0)
        return x + self._shift(position), y

    def _shift(self, position: int) -> float:
        """Sideways shift of a series' points; lines stay where they are."""
        dodged = [i for i, series in enumerate(self.chart.series) if series.style == "points"]
        return (dodged.index(position) - (len(dodged) - 1) / 2) * _DODGE if position in dodged else 0.0


def log_chart(stream: Stream, entity: str, chart: Chart, colors: Mapping[str, at.Rgb], empty: str) -> None:
    """Draw a chart at `entity`, in place of the one before; without points it says `empty`.

    Args:
        stream: the recording.
        entity: where to draw.
        chart: what to draw.
        colors: of series by name, such as lasers; for those that have no colour of their own.
        empty: text in place of a chart without points.
    """
    if chart.is_empty:
        log_note(stream, entity, empty)
        return
    stream.log(entity, rr.Clear(recursive=True))
    plot = Plot.of(chart)
    _log_axes(stream, entity, plot)
    _log_limits(stream, entity, plot)
    named = {name: at.to_hex(color) for name, color in colors.items()}
    for position, color in enumerate(series_colors(chart.series, named)):
        place = at.under(f"{entity}/series", chart.series[position].name)
        _log_series(stream, place, plot, position, at.from_hex(color))
    _log_outliers(stream, f"{entity}/outliers", plot)


def log_note(stream: Stream, entity: str, text: str) -> None:
    """A line of text in place of a chart."""
    stream.log(entity, rr.Clear(recursive=True))
    note = rr.Points2D([(WIDTH / 2, HEIGHT / 2)], labels=[text], colors=at.WHITE, radii=_NONE)
    stream.log(f"{entity}/note", note)


def _log_axes(stream: Stream, entity: str, plot: Plot) -> None:
    chart, low = plot.chart, plot.y.low
    rows = plot.y.round_ticks()
    above, below = x_ticks(chart, plot.x, _LEAST_TICK_DISTANCE)
    columns = [*above, *below]
    lines: list[Strip] = [[plot.at(plot.x.low, y), plot.at(plot.x.high, y)] for y in rows]
    lines += [[plot.at(x, low), plot.at(x, plot.y.high)] for x in columns]
    colors = [at.GREY if y == 0 else _GRID for y in rows] + [_GRID] * len(columns)
    stream.log(f"{entity}/grid", rr.LineStrips2D(lines, colors=colors, radii=_THIN, draw_order=-10.0))
    labels = {(-55.0, plot.at(plot.x.low, y)[1] - _LABEL_RISE): _y_text(y, chart.y.unit) for y in rows}
    for row_y, ticks in zip(_TICK_ROWS_Y, (above, below), strict=True):
        labels |= {(plot.at(x, low)[0], row_y): f"{x:g}" for x in ticks}
    labels[WIDTH / 2, _TITLE_Y] = chart.title
    labels[WIDTH / 2, _X_LABEL_Y] = f"{chart.y.text} against {chart.x.text}"
    _log_labels(stream, f"{entity}/ticks", labels)


def _y_text(value: float, unit: str) -> str:
    return f"{value:+.3g} {unit}".rstrip() if value else "0"


def _log_labels(stream: Stream, entity: str, labels: Mapping[Point, str]) -> None:
    texts = list(labels.values())
    points = rr.Points2D(list(labels), labels=texts, colors=at.GREY, radii=_NONE, show_labels=True)
    stream.log(entity, points)


def _log_limits(stream: Stream, entity: str, plot: Plot) -> None:
    """Limits and the edges of bands, each with its name at its right end."""
    edges: list[tuple[str, Strip]] = [
        (one.name, [plot.at(plot.x.low, one.y), plot.at(plot.x.high, one.y)]) for one in plot.chart.limits
    ]
    for band in plot.chart.bands:
        edges += [
            (band.name, [plot.at(x, y) for x, y in zip(band.x, side, strict=True)])
            for side in (band.low, band.high)
        ]
    if edges:
        strips = [strip for _, strip in edges]
        names = [name for name, _ in edges]
        lines = rr.LineStrips2D(strips, colors=at.GREY, radii=_BAR, labels=names, show_labels=True)
        stream.log(f"{entity}/limits", lines)


def _log_series(stream: Stream, entity: str, plot: Plot, position: int, color: at.Rgb) -> None:
    series = plot.chart.series[position]
    there = [i for i, y in enumerate(series.y) if y is not None]
    points = [(40.0 + _LEGEND_STEP * position, _LEGEND_Y)]
    if series.style == "line":
        runs = [[plot.point(position, i) for i in run] for run in _runs(series)]
        stream.log(f"{entity}/line", rr.LineStrips2D(runs, colors=color, radii=_BAR))
    else:
        points += [plot.point(position, i) for i in there]
    labels = [series.name] + [""] * (len(points) - 1)
    stream.log(entity, rr.Points2D(points, colors=color, radii=_DOT, labels=labels, show_labels=True))
    bars = [bar for i in there if len(bar := plot.strip(position, i)) > 1]
    if bars:
        stream.log(f"{entity}/one_sigma", rr.LineStrips2D(bars, colors=color, radii=_BAR))


def _runs(series: Series) -> Iterator[list[int]]:
    """Indices of the points between gaps."""
    run: list[int] = []
    for i, y in enumerate(series.y):
        if y is not None:
            run.append(i)
        elif run:
            yield run
            run = []
    if run:
        yield run


def _log_outliers(stream: Stream, entity: str, plot: Plot) -> None:
    """Red rings around what the standard deviation does not explain: a bad standoff is seen at once."""
    found = [
        (series.sigmas(i) or 0.0, position, i)
        for position, series in enumerate(plot.chart.series)
        for i in range(len(series.x))
        if series.is_outlier(i)
    ]
    if not found:
        return
    # One label for each x: with more of them none can be read.
    worst = {plot.chart.series[position].x[i]: (position, i) for _, position, i in sorted(found)}
    labels = [
        _outlier(plot.chart, position, i, sigmas) if (position, i) in worst.values() else ""
        for sigmas, position, i in found
    ]
    places = [plot.point(position, i) for _, position, i in found]
    rings = rr.Points2D(places, colors=at.RED, radii=_RING, labels=labels, show_labels=True, draw_order=-5.0)
    stream.log(entity, rings)


def _outlier(chart: Chart, position: int, index: int, sigmas: float) -> str:
    series = chart.series[position]
    return f"{series.name} at {series.x[index]:g} {chart.x.unit}: {sigmas:.1f} sigma"
