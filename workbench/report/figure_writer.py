"""Writer of the charts of finished trials into the session folder, as SVG pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from workbench.model.event import Record, TrialFinished
from workbench.session.files import write_record


@dataclass
class FigureWriter:
    """Consumer of records that writes `<chart name>.svg` for each chart of a trial."""

    session_dir: Path
    colors: Mapping[str, str]
    """Colours (`#rrggbb`) by series name, for example of lasers."""

    def __call__(self, record: Record) -> None:
        """Write the charts of a finished trial; ignore other records."""
        if isinstance(record.event, TrialFinished) and record.event.charts:
            from workbench.figures.figure import svg  # loads matplotlib, which most sessions do not need

            for chart in record.event.charts:
                write_record(self.session_dir / f"{chart.name}.svg", svg(chart, self.colors))
