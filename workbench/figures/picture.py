"""Picture of a chart for the viewer, with the place of its axes in pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO

from matplotlib.figure import Figure

from workbench.figures.figure import draw
from workbench.figures.plot_style import own_style
from workbench.model.chart import Chart

SIZE_PX = (1100, 400)
SMALL_PX = (700, 400)
"""For a narrow panel."""
DPI = 100.0


@dataclass(frozen=True)
class Picture:
    """PNG picture; pixel positions count from the top left corner."""

    png: bytes
    width_px: int
    height_px: int
    x_px: Mapping[float, float]
    """Column of each value of x in the chart."""
    top_px: float
    """Row of the upper end of the axes."""
    bottom_px: float


def picture(chart: Chart, colors: Mapping[str, str], size_px: tuple[int, int] = SIZE_PX) -> Picture:
    """Draw a chart on a dark ground.

    Args:
        chart: chart to draw.
        colors: colours (`#rrggbb`) by series name, for example of lasers.
        size_px: width and height.
    """
    width, height = size_px
    file = BytesIO()
    with own_style(dark=True):
        figure = draw(chart, colors, (width / DPI, height / DPI))
        figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})
        (axes,) = figure.axes
        box = axes.get_window_extent()
        scale = DPI / figure.dpi
        columns = {
            x: float(axes.transData.transform((x, 0.0 if chart.y.scale == "linear" else 1.0))[0])
            for x in chart.x_values()
        }
    return Picture(
        file.getvalue(),
        width,
        height,
        {x: scale * column for x, column in columns.items()},
        height - scale * float(box.y1),
        height - scale * float(box.y0),
    )


def note(text: str, size_px: tuple[int, int] = SIZE_PX) -> bytes:
    """PNG picture of a text, in place of a chart without points."""
    file = BytesIO()
    with own_style(dark=True):
        figure = Figure(figsize=(size_px[0] / DPI, size_px[1] / DPI))
        figure.text(0.5, 0.5, text, ha="center", va="center")
        figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})
    return file.getvalue()
