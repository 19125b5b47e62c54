"""Recording of results as data: a verdict in words, tables, and charts, without a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill

from workbench.model.chart import Chart
from workbench.model.table import Table
from workbench.viewer import entities as at
from workbench.viewer.blueprint import results_layout
from workbench.viewer.chart import log_chart
from workbench.viewer.compaction import compact
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import WIDTH, table_text

NO_POINTS = "no values"


def record_results(
    out: Path,
    name: str,
    headline: str,
    tables: Sequence[Table],
    charts: Sequence[Chart],
    colors: Mapping[str, str],
) -> None:
    """Write a recording of results; only a complete one replaces the file.

    Args:
        out: file.
        name: name of the recording.
        headline: result in words, in lines that are wrapped.
        tables: tables, shown in this order.
        charts: charts, two on a screen.
        colors: colours (`#rrggbb`) by name of a series.

    Raises:
        OSError: the file cannot be written.
    """
    layout = results_layout(name, [(chart.name, chart.title or chart.name) for chart in charts])
    partial = out.with_name(out.name + ".partial")
    try:
        stream = Stream(partial, name, layout)
        by_name = {series: at.from_hex(color) for series, color in colors.items()}
        for chart in charts:
            log_chart(stream, at.trial_picture(name, chart.name), chart, by_name, NO_POINTS)
        head = "\n".join(fill(line, WIDTH) for line in headline.splitlines())
        text = "\n\n".join((head, *map(table_text, tables)))
        stream.log_static_text(at.trial_tables(name), text)
        stream.close()
        compact(partial, layout)
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
