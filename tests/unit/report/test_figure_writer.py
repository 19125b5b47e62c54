"""Figures beside the journal."""

from __future__ import annotations

from pathlib import Path

from tests.unit.trials.thesis.test_figures import simulated
from workbench.model.event import Record
from workbench.model.simulation import SimulationFinished
from workbench.report.figure import svg
from workbench.report.figure_writer import FigureWriter
from workbench.trials.thesis.figures import figures


def test_figures_are_written_once_the_simulation_has_finished(tmp_path: Path) -> None:
    writer = FigureWriter(tmp_path)
    scene = simulated("flat-horizontal")
    writer(Record(n=0, time_ns=0, event=scene))
    assert list(tmp_path.iterdir()) == []
    writer(Record(n=1, time_ns=1, event=SimulationFinished(trial="t", rows=())))
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert written == {f"{chart.name}.svg": svg(chart) for chart in figures({scene.scene.name: scene})}
    assert set(written) == {"figure-21.svg", "figure-22.svg"}


def test_a_second_simulation_starts_without_the_first_one_s_scenes(tmp_path: Path) -> None:
    writer = FigureWriter(tmp_path)
    for n in range(2):
        finished = SimulationFinished(trial="t", rows=())
        if n == 0:
            writer(Record(n=n, time_ns=n, event=simulated("flat-horizontal")))
        writer(Record(n=10 + n, time_ns=n, event=finished))
        assert bool(list(tmp_path.iterdir())) is (n == 0)
        for path in tmp_path.iterdir():
            path.unlink()
