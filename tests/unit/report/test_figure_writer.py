"""Figures beside the journal."""

from __future__ import annotations

from pathlib import Path

from workbench.figures.figure import svg
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import Event, Record, TrialFinished, TrialProgress
from workbench.report.figure_writer import FigureWriter

COLORS = {"a": "#112233"}


def chart(name: str) -> Chart:
    series = Series(name="a", x=(1.0, 2.0), y=(3.0, None))
    return Chart(name=name, title=name, x=Axis(label="x"), y=Axis(label="y", unit="mm"), series=(series,))


def write(folder: Path, event: Event) -> dict[str, bytes]:
    FigureWriter(folder, COLORS)(Record(n=0, time_ns=0, event=event))
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_every_chart_of_a_finished_trial_is_written(tmp_path: Path) -> None:
    charts = chart("t.1-errors"), chart("figure-21")
    written = write(tmp_path, TrialFinished(trial="t.1", charts=charts))
    assert written == {f"{one.name}.svg": svg(one, COLORS) for one in charts}


def test_nothing_is_written_before_a_trial_has_finished(tmp_path: Path) -> None:
    assert write(tmp_path, TrialProgress(trial="t.1", text="half")) == {}
