"""Charts of trials as figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workbench.model.chart import Chart
from workbench.model.errors import BadInputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(chart: Chart) -> Figure:
    """Figure of a chart of `Trial.charts`, by matplotlib; the style is that of the session's figures.

    Raises:
        BadInputError: this is no chart.
    """
    from workbench.figures.figure import draw as draw_chart  # loads matplotlib
    from workbench.figures.plot_style import own_style

    if not isinstance(chart, Chart):
        raise BadInputError(f"chart: expected one of Trial.charts, got {type(chart).__name__}")
    with own_style():
        return draw_chart(chart, {})
