"""Figure of a chart, drawn by matplotlib; equal charts give equal bytes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from io import BytesIO

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from matplotlib.transforms import ScaledTranslation, Transform

from workbench.figures.plot_style import own_style
from workbench.model.chart import Chart, Series, series_colors
from workbench.model.chart_scale import tick_texts, x_scale, x_ticks, y_scale

SIZE_IN = (7.6, 4.4)
TICK_DISTANCE = 0.07
"""Least distance between two labels of x, as a share of the axis."""
LEGEND_CHARACTERS, SYMBOL_CHARACTERS = 100, 8
"""Width of a line of the legend and of a symbol with its gaps, in characters."""
MOST_NAMES = 20
"""Largest number of names in a legend."""
MARKER_POINTS = 4
OUTLIER_COLOR = "#d00000"
ASIDE_POINTS = 3.0
"""Distance sideways between points of series at equal x."""
FLAG_HALF_WIDTH = 0.02
"""Half width of a shaded range, as a share of the axis."""


def svg(chart: Chart, colors: Mapping[str, str]) -> bytes:
    """SVG file of a chart. Text is stored as outlines, independent of installed fonts.

    Args:
        chart: chart to draw.
        colors: colours (`#rrggbb`) by series name, for example of lasers.
    """
    file = BytesIO()
    with own_style():
        draw(chart, colors).savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()


def draw(chart: Chart, colors: Mapping[str, str], size_in: tuple[float, float] = SIZE_IN) -> Figure:
    """Figure of a chart, without pyplot and its global state. Call it within `own_style`."""
    figure = Figure(figsize=size_in, layout="constrained")
    axes = figure.add_subplot()
    _draw_axes(axes, chart)
    for low, high in _flagged(chart):
        axes.axvspan(low, high, color=OUTLIER_COLOR, alpha=0.25, linewidth=0)
    for band in chart.bands:
        axes.fill_between(band.x, band.low, band.high, alpha=0.2, label=band.name, linewidth=0)
    for limit in chart.limits:
        axes.axhline(limit.y, color=OUTLIER_COLOR, linestyle="--", linewidth=1, label=limit.name)
    drawn = list(zip(chart.series, series_colors(chart.series, colors), strict=True))
    points = [series.name for series in chart.series if series.style == "points"]
    for series, color in drawn:
        aside = points.index(series.name) - (len(points) - 1) / 2 if series.name in points else 0.0
        _draw_series(axes, series, color, _beside(figure, axes, aside * ASIDE_POINTS))
    axes.set_title(chart.title, loc="left", fontsize=11, fontweight="bold")
    names = [series.name for series in chart.series] + [band.name for band in chart.bands]
    names += [limit.name for limit in chart.limits]
    if len(names) > 1:
        _draw_legend(figure, axes)
    return figure


def _draw_legend(figure: Figure, axes: Axes) -> None:
    """Legend below the axes, each name once; of many names the first ones."""
    handles, names = axes.get_legend_handles_labels()
    named = dict(zip(reversed(names), reversed(handles), strict=True))
    shown = list(dict.fromkeys(names))
    more = len(shown) - MOST_NAMES
    shown = shown[:MOST_NAMES]
    labels = [*shown[:-1], f"{shown[-1]} and {more} more"] if more > 0 else shown
    columns = max(1, LEGEND_CHARACTERS // (max(map(len, labels)) + SYMBOL_CHARACTERS))
    marks = [named[name] for name in shown]
    figure.legend(marks, labels, loc="outside lower left", ncols=columns, frameon=False)


def _draw_axes(axes: Axes, chart: Chart) -> None:
    x, y = x_scale(chart), y_scale(chart)
    axes.set(xscale=chart.x.scale, yscale=chart.y.scale, ylabel=chart.y.text)
    axes.set_xlabel("\n".join(line for line in (chart.x.text, chart.caption) if line))
    axes.set(xlim=(x.low, x.high), ylim=(y.low, y.high))
    above, below = x_ticks(chart, x, TICK_DISTANCE)
    texts = tick_texts([*above, *below])
    rows = [*texts[: len(above)], *(f"\n{text}" for text in texts[len(above) :])]
    axes.set_xticks([*above, *below], rows)
    axes.set_yticks(y.round_ticks(), tick_texts(y.round_ticks()))
    for one in (axes.xaxis, axes.yaxis):
        one.set_minor_locator(NullLocator())
    axes.grid()
    axes.set_axisbelow(True)
    if y.low < 0 < y.high:
        axes.axhline(0, color="#888888", linewidth=0.8)


def _flagged(chart: Chart) -> Iterator[tuple[float, float]]:
    """Ends of the shaded ranges of x about the chart's flagged values."""
    scale = x_scale(chart)
    for x in chart.flagged_x:
        if scale.is_log:
            factor = (scale.high / scale.low) ** FLAG_HALF_WIDTH
            yield x / factor, x * factor
        else:
            half = FLAG_HALF_WIDTH * (scale.high - scale.low)
            yield x - half, x + half


def _beside(figure: Figure, axes: Axes, points: float) -> Transform:
    """Transformation of the data that moves marks sideways, so that series at equal x do not overlap."""
    return axes.transData + ScaledTranslation(points / 72.0, 0.0, figure.dpi_scale_trans)


def _draw_series(axes: Axes, series: Series, color: str, beside: Transform) -> None:
    y = [float("nan") if value is None else value for value in series.y]
    if series.style == "line":
        dash = "--" if series.dashed else "-"
        axes.plot(series.x, y, color=color, linestyle=dash, linewidth=1.3, label=series.name)
        # A line through a single point has no length: draw the point itself.
        if single := [run[0] for run in series.runs() if len(run) == 1]:
            at = [series.x[i] for i in single], [y[i] for i in single]
            axes.plot(*at, "o", color=color, markersize=MARKER_POINTS)
    else:
        sd = [float("nan") if value is None else value for value in series.sd] or None
        axes.errorbar(
            series.x,
            y,
            sd,
            color=color,
            fmt="o",
            markersize=MARKER_POINTS,
            label=series.name,
            transform=beside,
        )
    outliers = [i for i in range(len(series.x)) if series.is_outlier(i)]
    if outliers:
        at = [series.x[i] for i in outliers], [y[i] for i in outliers]
        place = beside if series.style == "points" else axes.transData
        axes.plot(*at, "o", color=OUTLIER_COLOR, fillstyle="none", markersize=10, transform=place)
