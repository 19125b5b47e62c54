"""`workbench run` and `workbench resume`: a session with progress on the terminal and a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from workbench.cli.background import Background
from workbench.cli.console import print_message
from workbench.cli.in_force import note_if_not_in_force
from workbench.cli.invocation import command_line
from workbench.cli.refusal import ask_for_repair, refused_fit
from workbench.cli.replay_progress import NONE_KEPT
from workbench.cli.session_verdict import session_verdict
from workbench.cli.stopping import StopAfterCapture
from workbench.cli.terminal import FaultTolerantConsumer, Terminal
from workbench.cli.terminal_operator import choose_operator
from workbench.cli.verdict import VerdictShownError, show_verdict
from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.chart import laser_colors
from workbench.model.errors import (
    AnswerNeededError,
    LaserOffNotConfirmedError,
    LimitFailedError,
    RigNotReadyError,
    StoppedError,
)
from workbench.model.number_text import counted
from workbench.procedure.engine.durations import learn_durations
from workbench.procedure.engine.operator import ScriptedOperator
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.progress import TimeLeft
from workbench.procedure.engine.repair import Repair, kept_captures
from workbench.procedure.engine.resume import files_now, plan_of, resume
from workbench.procedure.engine.run import NO_OPERATOR, Invocation, run
from workbench.report.figure_writer import FigureWriter
from workbench.session.caller import now, operator
from workbench.session.journal import JOURNAL, read_journal
from workbench.session.manifest import MANIFEST, load_manifest
from workbench.session.repairs import repairs_of
from workbench.spots import is_compiled
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer
from workbench.viewer.window import has_display, viewer_executable, watch


@dataclass(frozen=True)
class Screen:
    """Options for what is shown and asked."""

    answers: Path | None = None
    """Answers file."""
    no_input: bool = False
    """Whether no person is asked."""
    view: bool | None = None
    """Whether to open the viewer; None: if there is a display."""
    details: bool = False
    """Whether to print the tables of fits, and all notes."""
    operator: str | None = None
    """Name of the person at the bench, for the record; None: the account."""
    stop: StopAfterCapture | None = None
    """Stop requests of a command that has work after the session; None: those of the session alone."""


@dataclass(frozen=True)
class SessionInterface:
    """Connections of a session to the user: consumers of its records, stop requests, operator."""

    consumers: tuple[ev.Consumer, ...]
    stopping: Callable[[], str | None]
    operator: Operator


def run_procedures(
    procedures: list[Path],
    rig_path: Path,
    sessions: Path,
    screen: Screen,
    calibration: Path | None = None,
) -> Path:
    """Run procedures in a new session with progress on the terminal and in the viewer.

    Returns:
        Folder of the session.

    Raises:
        WorkbenchError: see `workbench.procedure.engine.run.run`.
    """
    plan = Plan.load(rig_path, procedures, calibration)
    if plan.calibration is not None:
        note_if_not_in_force(plan.calibration.file, plan.calibration.calibration, sessions)
    session_dir = plan.new_session(sessions)
    with _repairable(session_dir, plan, screen) as ui:
        run(plan, session_dir, ui.consumers, _caller(screen), ui.stopping, ui.operator)
    return session_dir


def resume_session(
    session_dir: Path,
    accept_changes: str | None,
    screen: Screen,
    repair: Repair | None = None,
) -> None:
    """Resume a session that ended early, or repair one that has ended.

    Raises:
        WorkbenchError: see `workbench.procedure.engine.resume.resume`.
    """
    now, _ = files_now(session_dir, load_manifest(session_dir))
    plan = plan_of(session_dir, now)
    records = list(read_journal(session_dir)) if (session_dir / JOURNAL).exists() else []
    kept = kept_captures(plan, records, repair)
    if text := replay_text(kept):
        print_message(text)
    added_mm = [*repairs_of(records).added_mm, *(() if repair is None else repair.add_mm)]
    with _repairable(session_dir, plan, screen, kept, added_mm) as ui:
        resume(session_dir, ui.consumers, _caller(screen), ui.stopping, ui.operator, accept_changes, repair)


def replay_text(kept: Mapping[str, int]) -> str:
    """Announcement that captures are read from disk, before their progress looks like new ones.

    Args:
        kept: numbers of captures of the placements that are not captured again, by key.

    Returns:
        Text in one line; empty if there is nothing to read.
    """
    captures = sum(kept.values())
    if not captures:
        return ""
    of = f"{counted(captures, 'capture')} of {counted(len(kept), 'placement')}"
    return (
        f"replaying {of} from disk: no laser is switched on for them, and their spots are found again;"
        " the time left is shown"
    )


@contextmanager
def _repairable(
    session_dir: Path,
    plan: Plan,
    screen: Screen,
    kept: Mapping[str, int] = NONE_KEPT,
    added_mm: Sequence[float] = (),
) -> Iterator[SessionInterface]:
    """`session_interface`, then the verdict; lets a person repair a refused calibration at once."""
    stop = screen.stop or StopAfterCapture()
    try:
        with session_interface(session_dir, plan, screen, stop, kept, added_mm) as ui:
            yield ui
    except LimitFailedError as refused:
        show_verdict(session_verdict(session_dir, refused))
        if not _repaired(session_dir, screen, stop):
            raise VerdictShownError(str(refused)) from refused
        return
    show_verdict(session_verdict(session_dir, None))


def _repaired(session_dir: Path, screen: Screen, stop: StopAfterCapture) -> bool:
    """Whether a person has chosen a repair, which has then been done."""
    fit = refused_fit(session_dir)
    if fit is None:
        return False
    console = Console(stderr=True, markup=False)
    person = choose_operator(screen.no_input, console, lambda: stop.reason, nullcontext)
    repair = ask_for_repair(fit, person)
    if repair is None:
        return False
    resume_session(session_dir, None, replace(screen, stop=stop), repair)
    return True


@contextmanager
def session_interface(
    session_dir: Path,
    plan: Plan,
    screen: Screen,
    stop: StopAfterCapture,
    kept: Mapping[str, int] = NONE_KEPT,
    added_mm: Sequence[float] = (),
) -> Iterator[SessionInterface]:
    """Terminal, recording, viewer, figures and operator for a session; adds to errors how to resume it.

    Args:
        session_dir: folder of the session.
        plan: rig and procedures.
        screen: options.
        stop: stop requests.
        kept: numbers of captures of the placements that are not captured again, by key.
        added_mm: standoffs that repairs have added, for the prompts of an answers file.
    """
    watched = watch if screen.view or (screen.view is None and has_display()) else None
    if watched is not None:
        viewer_executable()  # missing, it is named before the bench is opened
    console = Console(stderr=True, markup=False)
    script = None
    if screen.answers is not None:
        script = ScriptedOperator.load(screen.answers, plan.prompts(added_mm), NO_OPERATOR)
    steps = plan.steps()
    if not is_compiled():
        print_message("note: the first capture compiles the search for spots, once, in one or two minutes")
    forecast = TimeLeft(steps, learn_durations(session_dir.parent, plan.rig.rig))
    recording = RecordingConsumer(session_dir, plan.rig, watch=watched)
    file = session_dir / RECORDING_FILE
    with (
        Background(recording, file, console) as beside,
        Terminal(console, forecast, screen.details, kept) as terminal,
    ):
        person = beside.asking(choose_operator(screen.no_input, console, lambda: stop.reason, terminal.quiet))
        operator = person if script is None else replace(script, other=person)
        writer = FigureWriter(session_dir, laser_colors(plan.rig.laser_ids))
        figures = FaultTolerantConsumer(writer, "drawing figures", console)
        consumers = (FaultTolerantConsumer(terminal, "the progress", console), figures, beside)
        try:
            yield SessionInterface(consumers, lambda: stop.reason, operator)
        except (RigNotReadyError, StoppedError, AnswerNeededError, LaserOffNotConfirmedError) as error:
            if (session_dir / MANIFEST).exists():  # after the message: lasers that may be on come first
                error.add_note(f"resume:  workbench resume {session_dir}")
            raise


def _caller(screen: Screen) -> Invocation:
    return Invocation(operator=operator(screen.operator), command=command_line(), created=now())
