"""Charts drawn with lines and points in a 2D view.

Rerun plots only against time. Quantities against standoff are therefore drawn, and stay visible wherever the
time cursor is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot

import rerun as rr

from workbench.model.chart import Chart, series_colors
from workbench.model.chart_scale import Scale, x_scale, x_ticks, y_scale
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

WIDTH, HEIGHT = 1000.0, 420.0
BOUNDS_X, BOUNDS_Y = (-110.0, 1060.0), (-140.0, 550.0)
"""Visible area of a chart: plot, tick labels, and title and legend above the plot."""
_DODGE = 7.0
"""Horizontal shift between series, so that their bars do not overlap."""
_LEAST_TICK_DISTANCE = 0.055
"""Least distance between labels of x, as a share of the plot's width."""
_LABEL_RISE = 17.0
"""Upward shift of a label to the height of its grid line; the viewer draws labels below their points."""
_TITLE_Y, _X_LABEL_Y = -137.0, HEIGHT + 84.0
_TICK_ROWS_Y = (HEIGHT + 10.0, HEIGHT + 46.0)
_LEGEND_Y = (-90.0, -42.0)
"""Heights of the first row of a legend with several rows, and of its last row."""
_LEGEND_SPACING, _LEGEND_CHARACTER = 60.0, 13.0
"""Width of a legend entry: its mark with the gaps beside it, and each character of the name."""
_DASH, _DASH_GAP = 14.0, 9.0
"""Lengths of a dash and of the gap after it."""
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
    """Chart with the scales that map it to the plot, `WIDTH` x `HEIGHT`, y down."""

    chart: Chart
    x: Scale
    y: Scale

    @classmethod
    def of(cls, chart: Chart) -> Plot:
        """Plot of a chart."""
        return cls(chart, x_scale(chart), y_scale(chart))

    def at(self, x: float, y: float) -> Point:
        """Position of a pair of values; values beyond the axis limits are drawn on the edge of the plot."""
        across, up = (min(max(share, 0.0), 1.0) for share in (self.x.share(x), self.y.share(y)))
        return WIDTH * across, HEIGHT * (1 - up)

    def strip(self, position: int, index: int) -> Strip:
        """Point of a series or the ends of its bar, shifted so that series do not overlap."""
        series = self.chart.series[position]
        places = [self.at(series.x[index], y) for y in series.bar(index)]
        return [(x + self._shift(position), y) for x, y in places]

    def point(self, position: int, index: int) -> Point:
        """Position of a point of a series, which must not be a gap."""
        series = self.chart.series[position]
        x, y = self.at(series.x[index], series.y[index] or 0.0)
        return x + self._shift(position), y

    def _shift(self, position: int) -> float:
        """Horizontal shift of the points of a series; lines are not shifted."""
        dodged = [i for i, series in enumerate(self.chart.series) if series.style == "points"]
        return (dodged.index(position) - (len(dodged) - 1) / 2) * _DODGE if position in dodged else 0.0


def log_chart(stream: Stream, entity: str, chart: Chart, colors: Mapping[str, at.Rgb], empty: str) -> None:
    """Draw a chart at `entity`, replacing the previous one.

    Args:
        stream: recording.
        entity: entity of the chart.
        chart: chart to draw.
        colors: colours by series name, for example of lasers, for series without their own colour.
        empty: text instead of a chart without points.
    """
    if chart.is_empty:
        log_note(stream, entity, empty)
        return
    stream.log(entity, rr.Clear(recursive=True))
    plot = Plot.of(chart)
    _log_axes(stream, entity, plot)
    _log_limits(stream, entity, plot)
    named = {name: at.to_hex(color) for name, color in colors.items()}
    legend = legend_points([series.name for series in chart.series])
    for position, color in enumerate(series_colors(chart.series, named)):
        place = at.under(f"{entity}/series", chart.series[position].name)
        _log_series(stream, place, plot, position, at.from_hex(color), legend[position])
    _log_outliers(stream, f"{entity}/outliers", plot)


def log_note(stream: Stream, entity: str, text: str) -> None:
    """Log a line of text instead of a chart."""
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
    """Log limits and edges of bands with their names."""
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


def legend_points(names: Sequence[str]) -> list[Point]:
    """Positions of the marks of a legend, in as many rows above the plot as the lengths of names require."""
    widths = [_LEGEND_SPACING + _LEGEND_CHARACTER * len(name) for name in names]
    rows: list[int] = []
    lefts: list[float] = []
    right, row = 0.0, 0
    for width in widths:
        if right and right + width > WIDTH:
            right, row = 0.0, row + 1
        rows.append(row)
        lefts.append(right)
        right += width
    top, bottom = _LEGEND_Y
    step = (bottom - top) / max(row, 1)
    # The viewer centres a name below its mark.
    return [
        (left + width / 2, bottom - step * (row - own))
        for left, width, own in zip(lefts, widths, rows, strict=True)
    ]


def _log_series(stream: Stream, entity: str, plot: Plot, position: int, color: at.Rgb, legend: Point) -> None:
    series = plot.chart.series[position]
    runs = [[plot.point(position, i) for i in run] for run in series.runs()]
    points = [legend]
    if series.style == "line":
        lines = [run for run in runs if len(run) > 1]
        strips = [dash for run in lines for dash in dashes(run)] if series.dashed else lines
        stream.log(f"{entity}/line", rr.LineStrips2D(strips, colors=color, radii=_BAR))
        points += [run[0] for run in runs if len(run) == 1]  # a line through one point has no length
    else:
        points += [point for run in runs for point in run]
    labels = [series.name] + [""] * (len(points) - 1)
    stream.log(entity, rr.Points2D(points, colors=color, radii=_DOT, labels=labels, show_labels=True))
    indices = [i for run in series.runs() for i in run]
    bars = [bar for i in indices if len(bar := plot.strip(position, i)) > 1]
    if bars:
        stream.log(f"{entity}/one_sigma", rr.LineStrips2D(bars, colors=color, radii=_BAR))


def dashes(line: Strip) -> Iterator[Strip]:
    """Dashes along a line; gaps and dashes have constant length, measured along the line."""
    period = _DASH + _DASH_GAP
    start = 0.0
    for (x0, y0), (x1, y1) in pairwise(line):
        length = hypot(x1 - x0, y1 - y0)
        if length == 0.0:
            continue
        first = int(start // period)
        for number in range(first, ceil((start + length) / period)):
            low = max(number * period - start, 0.0) / length
            high = min(number * period + _DASH - start, length) / length
            if low < high:
                yield [(x0 + share * (x1 - x0), y0 + share * (y1 - y0)) for share in (low, high)]
        start += length


def _log_outliers(stream: Stream, entity: str, plot: Plot) -> None:
    """Log red rings around outliers."""
    found = [
        (series.sigmas(i) or 0.0, position, i)
        for position, series in enumerate(plot.chart.series)
        for i in range(len(series.x))
        if series.is_outlier(i)
    ]
    if not found:
        return
    # One label per x, of the worst outlier: more would overlap.
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
