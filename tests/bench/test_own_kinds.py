"""A step kind and a trial of one's own, in one module each: they need no edit anywhere else.

The kinds of `own_step` and `own_trial` below are defined in this test. `spread_trial` comes from the package
in `examples/own_trial`, installed into a folder of the test's own. All of them go through check, plan, run,
kill and resume, the terminal, the recording and CSV.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import pandas as pd
import pytest
from rerun import escape_entity_path_part

from tests.crash.short import ROOT, results, write_files
from tests.support.killed_session import wait_for_capture
from tests.viewer.readback import Contents, layout_views
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import TrialFinished
from workbench.model.fields import Standoff
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.placements import visit_placements
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel, flat_placement
from workbench.session.journal import read_journal
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial

PROCEDURE = """\
format: 1
procedure: own
title: Kinds of our own
steps:
  - step: capture_grid
    standoffs_mm: [300, 600, 1500]
    repeats: 1
  - step: fit
    limits: {max_relative_range_sd: 0.5}
  - step: export
"""
IN_TEST = """\
  - step: own_step
    standoff_mm: 450
  - step: own_trial
    standoff_mm: 700
"""
PROVENANCE = ("command:", "created:", "session:")
INSTALLED = """\
  - step: spread_trial
    standoffs_mm: [450, 700]
    readings: 3
"""


@register
class OwnStep(StepModel):
    """Fires each laser once."""

    step: Literal["own_step"]
    standoff_mm: Standoff

    @property
    def title(self) -> str:
        return "Fire each laser once"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        return [flat_placement(name, self.standoff_mm)]

    def captures(self, rig: Rig) -> int:
        return len(rig.lasers)

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        return [*super().prompts(name, rig), Prompt(f"{name}/seen", "Did you see the beams?")]

    def run(self, context: Context, name: str) -> str:
        pairs = visit_placements(
            context, self.placements(name, context.rig), lambda placed: capture_lasers(context, placed, 1)
        )
        context.ask(Prompt(f"{name}/seen", "Did you see the beams?"))
        return f"{sum(pairs)} pairs"


@register
class OwnTrialStep(StepModel):
    """Three readings at one placement."""

    needs: ClassVar[str | None] = "calibration"
    step: Literal["own_trial"]
    standoff_mm: Standoff

    @property
    def title(self) -> str:
        return "Three readings"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        return [flat_placement(name, self.standoff_mm)]

    def captures(self, rig: Rig) -> int:
        return 3

    def run(self, context: Context, name: str) -> str:
        ranger = session_ranger(context, name)
        (readings,) = visit_placements(
            context,
            self.placements(name, context.rig),
            lambda placed: take_readings(context, ranger, name, placed, 3),
        )
        ranges = tuple(reading.range_mm for reading in readings)
        columns = (
            Column(key="reading", name="reading"),
            Column(key="range_mm", name="range", unit="mm", format=".3f"),
        )
        table = Table(name=name, title="Ranges of our own", columns=columns, rows=tuple(enumerate(ranges)))
        series = Series(name="ranges", x=(1.0, 2.0, 3.0), y=ranges, style="line")
        axes = Axis(label="reading"), Axis(label="range", unit="mm")
        finish_trial(
            context,
            name,
            [table],
            [Chart(name=f"{name}-ranges", title="Ranges", x=axes[0], y=axes[1], series=(series,))],
        )
        return "3 readings"


@dataclass(frozen=True)
class Bench:
    """Where the kinds are known, and files that use them."""

    folder: Path
    command: tuple[str, ...]
    environment: dict[str, str]
    trial: str
    """Name of the trial's step."""

    def call(self, *arguments: object, code: int = 0) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [*self.command, *map(str, arguments)],
            capture_output=True,
            text=True,
            env=self.environment,
            cwd=ROOT,
        )
        assert done.returncode == code, done.stderr
        return done

    @property
    def files(self) -> tuple[Path, ...]:
        return self.folder / "p.yaml", self.folder / "rig.yaml"

    def run_arguments(self, sessions: Path) -> tuple[object, ...]:
        procedure, rig = self.files
        return "run", procedure, "--rig", rig, "--sessions", sessions


@pytest.fixture(
    scope="module", params=["installed", pytest.param("in this test", marks=pytest.mark.thorough)]
)
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("own")
    environment = os.environ | {"COLUMNS": "80"}
    if request.param == "installed":
        write_files(folder, PROCEDURE + INSTALLED)
        site = folder / "site"
        source = ROOT / "examples/own_trial"
        options = ["--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--target", str(site)]
        subprocess.run([sys.executable, "-m", "pip", "install", *options, str(source)], check=True)
        environment["PYTHONPATH"] = str(site)
        command = (str(Path(sys.executable).with_name("workbench")),)
        return Bench(folder, command, environment, "own.4")
    write_files(folder, PROCEDURE + IN_TEST)
    code = f"import {__name__}; from workbench.cli.main import main; main()"
    return Bench(folder, (sys.executable, "-c", code), environment, "own.5")


@pytest.fixture(scope="module")
def session(bench: Bench) -> tuple[Path, str]:
    """A session that nobody disturbed, and what the terminal showed."""
    sessions = bench.folder / "sessions"
    terminal = bench.call(*bench.run_arguments(sessions)).stderr
    (folder,) = [path for path in sessions.iterdir() if path.is_dir()]
    return folder, terminal


def test_check_accepts_the_kinds_and_names_a_mistake_with_its_line(bench: Bench, tmp_path: Path) -> None:
    bench.call("check", *bench.files)
    text = bench.files[0].read_text()
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(text + "    colour: red\n")
    told = bench.call("check", wrong, code=2).stderr
    line = len(wrong.read_text().splitlines())
    last = len(text.split("- step:")) - 2
    assert f"wrong.yaml:{line}: steps[{last}].colour" in "".join(told.split("\n"))


def test_plan_counts_placements_and_captures(bench: Bench) -> None:
    procedure, rig = bench.files
    plan = bench.call("plan", procedure, "--rig", rig, "--sessions", bench.folder / "none").stdout
    own = {"own.4": {"own.4": (2, 6)}, "own.5": {"own.4": (1, 2), "own.5": (1, 3)}}[bench.trial]
    for name, (placements, captures) in own.items():
        (line,) = [line for line in plan.splitlines() if name in line]
        numbers = [int(word) for word in line.replace("│", " ").split() if word.isdigit()]
        assert numbers[-3:-1] == [placements, captures]


def finished(session: Path) -> TrialFinished:
    (event,) = [r.event for r in read_journal(session) if isinstance(r.event, TrialFinished)]
    return event


def test_terminal_and_csv_show_the_table(bench: Bench, session: tuple[Path, str]) -> None:
    folder, terminal = session
    (table,) = finished(folder).tables
    lines = terminal.splitlines()
    shown = [line.split() for line in lines[lines.index(table.title) :]]
    for row in range(len(table.rows)):
        assert [table.text(row, column) for column in range(len(table.columns))] in shown
    read = pd.read_csv(folder / f"{bench.trial}.csv")
    assert list(read.columns) == [column.key for column in table.columns]
    assert read.to_dict("records") == table.records()
    # The verdict and the paths at the end are not wrapped without a terminal, so that they can be copied.
    end = next(n for n, line in enumerate(lines) if line.startswith(("ACCEPTED", "REFUSED", "DONE")))
    assert max(len(line) for line in lines[:end]) <= 80


def test_the_recording_shows_table_and_chart(bench: Bench, session: tuple[Path, str]) -> None:
    folder, _ = session
    event = finished(folder)
    contents = Contents(folder / "recording.rrd")
    trial = f"/trials/{escape_entity_path_part(event.trial)}"
    (text,) = contents.static(f"{trial}/tables", "TextDocument:text")[-1]
    assert event.tables[0].title in text
    assert f"{trial}/pictures/{event.charts[0].name}/image" in contents.entities
    assert event.charts[0].title in {view.name for view in layout_views(folder / "recording.rrd")}


@pytest.mark.thorough
def test_killed_and_resumed_it_ends_the_same(bench: Bench, session: tuple[Path, str]) -> None:
    whole, _ = session
    sessions = bench.folder / "killed"
    process = subprocess.Popen(
        [*bench.command, *map(str, bench.run_arguments(sessions))],
        env=bench.environment,
        cwd=ROOT,
        stderr=subprocess.DEVNULL,
    )
    killed = wait_for_capture(sessions, bench.trial, process)
    process.send_signal(signal.SIGKILL)
    process.wait()
    bench.call("resume", killed, code=0)
    assert without_provenance(results(killed)) == without_provenance(results(whole))
    assert finished(killed) == finished(whole)


def without_provenance(files: dict[str, bytes]) -> dict[str, bytes]:
    """Without what the command line and the clock write into the calibration."""
    text = files["calibration.yaml"].decode()
    lines = [line for line in text.splitlines() if not line.lstrip().startswith(PROVENANCE)]
    return files | {"calibration.yaml": "\n".join(lines).encode()}
