"""Writes a simulation's charts into the session folder, as SVG pictures."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from workbench.model.event import Record
from workbench.model.simulation import SceneSimulated, SimulationFinished
from workbench.session.files import write_record
from workbench.trials.thesis.figures import figures


@dataclass
class FigureWriter:
    """A consumer of records that writes `figure-21.svg` and others when their simulation has finished."""

    session_dir: Path
    _simulated: dict[str, SceneSimulated] = field(default_factory=dict)

    def __call__(self, record: Record) -> None:
        """Take one record."""
        if isinstance(record.event, SceneSimulated):
            self._simulated[record.event.scene.name] = record.event
        elif isinstance(record.event, SimulationFinished):
            self._write()
            self._simulated.clear()

    def _write(self) -> None:
        from workbench.report.figure import svg  # loads matplotlib, which most sessions do not need

        for chart in figures(self._simulated):
            write_record(self.session_dir / f"{chart.name}.svg", svg(chart))
