"""`workbench run` and `workbench resume`: progress on the terminal, the recording beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from workbench.cli.background import Background
from workbench.cli.console import say
from workbench.cli.invocation import command_line
from workbench.cli.stopping import StopAfterShot
from workbench.cli.terminal import FaultTolerantConsumer, Terminal
from workbench.cli.terminal_operator import choose_operator
from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.chart import laser_colors
from workbench.model.errors import (
    AnswerNeededError,
    LaserOffNotConfirmedError,
    RigNotReadyError,
    StoppedError,
)
from workbench.procedure.engine.durations import learn_durations
from workbench.procedure.engine.operator import ScriptedOperator
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.progress import TimeLeft
from workbench.procedure.engine.resume import files_now, plan_of, resume
from workbench.procedure.engine.run import NOBODY, Invocation, run
from workbench.report.figure_writer import FigureWriter
from workbench.session.caller import now, operator
from workbench.session.manifest import MANIFEST, load_manifest
from workbench.spots import is_compiled
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer


@dataclass(frozen=True)
class Answers:
    """Who answers, as the user asked for it."""

    file: Path | None = None
    no_input: bool = False


@dataclass(frozen=True)
class Screen:
    """What a session is run with: who sees its records, who stops it, who answers."""

    consumers: tuple[ev.Consumer, ...]
    stopping: Callable[[], str | None]
    operator: Operator


def run_procedures(procedures: list[Path], rig_path: Path, sessions: Path, answers: Answers) -> None:
    """Run, show the progress, and say where everything is.

    Raises:
        WorkbenchError: see `workbench.procedure.engine.run.run`.
    """
    plan = Plan.load(rig_path, procedures)
    session_dir = plan.new_session(sessions)
    with shown(session_dir, plan, answers) as screen:
        run(plan, session_dir, screen.consumers, _caller(), screen.stopping, screen.operator)


def resume_session(session_dir: Path, accept_changes: str | None, answers: Answers) -> None:
    """Go on with a session that ended early.

    Raises:
        WorkbenchError: see `workbench.procedure.engine.resume.resume`.
    """
    now, _ = files_now(session_dir, load_manifest(session_dir))
    plan = plan_of(session_dir, now)
    with shown(session_dir, plan, answers) as screen:
        resume(session_dir, screen.consumers, _caller(), screen.stopping, screen.operator, accept_changes)


@contextmanager
def shown(session_dir: Path, plan: Plan, answers: Answers) -> Iterator[Screen]:
    """Show a session on the terminal and in a recording while it runs, then say where everything is."""
    console = Console(stderr=True, markup=False)
    asked = StopAfterShot()
    script = None
    if answers.file is not None:
        script = ScriptedOperator.load(answers.file, plan.prompts(), NOBODY)
    steps = plan.steps()
    if not is_compiled():
        say("note: the search for spots is compiled at the first capture: a minute or two, this once")
    forecast = TimeLeft(steps, learn_durations(session_dir.parent, plan.rig.rig))
    recording = RecordingConsumer(session_dir, plan.rig)
    file = session_dir / RECORDING_FILE
    with Background(recording, file, console) as beside, Terminal(console, forecast) as terminal:
        person = choose_operator(answers.no_input, console, lambda: asked.reason, terminal.quiet)
        operator = person if script is None else replace(script, other=person)
        writer = FigureWriter(session_dir, laser_colors(plan.rig.laser_ids))
        figures = FaultTolerantConsumer(writer, "drawing figures", console)
        consumers = (FaultTolerantConsumer(terminal, "the progress", console), figures, beside)
        try:
            yield Screen(consumers, lambda: asked.reason, operator)
        except (RigNotReadyError, StoppedError, AnswerNeededError, LaserOffNotConfirmedError):
            if (session_dir / MANIFEST).exists():
                with suppress(OSError):  # a terminal that was closed
                    console.print(
                        f"go on:   workbench resume {session_dir}",
                        highlight=False,
                        soft_wrap=True,
                        markup=False,
                    )
            raise
    console.print(f"session: {session_dir}", highlight=False, soft_wrap=True)
    console.print(f"replay:  workbench view {session_dir}", highlight=False, soft_wrap=True)


def _caller() -> Invocation:
    return Invocation(operator=operator(), command=command_line(), created=now())
