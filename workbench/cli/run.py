"""`workbench run`: progress on the terminal, the recording beside it."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from rich.console import Console
from rich.padding import Padding
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.text import Text

from workbench.cli.call import command_line, now, operator
from workbench.cli.stopping import StopAfterShot
from workbench.model import event as ev
from workbench.model.errors import StoppedError
from workbench.procedure.run import Caller, Plan, run
from workbench.report.tables import parameter_table, rejected_lines, term_table, trial_table
from workbench.viewer.recording import RecordingConsumer


def run_procedures(procedures: list[Path], rig_path: Path, sessions: Path) -> None:
    """Run, show the progress, and say where everything is.

    Raises:
        WorkbenchError: see `workbench.procedure.run.run`.
    """
    plan = Plan.load(rig_path, procedures)
    session_dir = plan.new_session(sessions)
    console = Console(stderr=True)
    stopping = StopAfterShot()
    with RecordingConsumer(session_dir, plan.rig) as recording, Terminal(console) as terminal:
        consumers = (terminal, Guarded(recording, "the recording", console))
        caller = Caller(operator=operator(), command=command_line(), created=now())
        run(plan, session_dir, consumers, caller, lambda: stopping.reason)
    console.print(f"session: {session_dir}", highlight=False, soft_wrap=True)
    console.print(f"replay:  workbench view {session_dir}", highlight=False, soft_wrap=True)


class Terminal:
    """Shows the records of a session as they come."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._task: TaskID | None = None

    def __enter__(self) -> Terminal:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def __call__(self, record: ev.Record) -> None:
        """Show one record."""
        match record.event:
            case ev.ProcedureStarted() as e:
                self._console.print(f"[bold]{e.title}[/bold] ({e.procedure}, {e.steps} steps)")
            case ev.StepStarted() as e:
                self._console.print(Padding(Text(f"{e.index}. {e.title}"), (0, 0, 0, 2)))
                if e.shots:
                    self._task = self._progress.add_task("     capturing", total=e.shots)
            case ev.TargetPlaced(placement=placement) if self._task is not None:
                self._progress.update(self._task, description=f"     {placement.standoff_mm:g} mm")
            case ev.CaptureTaken() as e if self._task is not None and _counts(e):
                self._progress.advance(self._task)
            case ev.StepFinished() as e:
                self._end_step(e.outcome)
            case ev.FitFinished() as e:
                self._console.print(parameter_table(e.parameters))
                if e.terms:
                    self._console.print(term_table(e.terms))
                for line in rejected_lines(e.rejected):
                    self._console.print(Padding(Text(f"not used: {line}"), (0, 0, 0, 5)))
                for warning in e.warnings:
                    self._console.print(Padding(Text(f"note: {warning}"), (0, 0, 0, 5)))
            case ev.TrialFinished() as e:
                self._console.print(trial_table(e.rows))
            case _:
                pass

    def _end_step(self, outcome: str) -> None:
        if self._task is not None:
            self._progress.remove_task(self._task)
            self._task = None
        self._console.print(Padding(Text(outcome), (0, 0, 0, 5)))


class Guarded:
    """A consumer that may fail without stopping the session: frames and journal are the record, not it."""

    def __init__(self, consumer: ev.Consumer, name: str, console: Console) -> None:
        self._consumer: ev.Consumer | None = consumer
        self._name, self._console = name, console

    def __call__(self, record: ev.Record) -> None:
        """Hand the record on; after a failure, never again."""
        if self._consumer is None:
            return
        try:
            self._consumer(record)
        except StoppedError:
            raise  # a signal that came while the consumer was at work
        except Exception as error:
            self._consumer = None
            self._console.print(
                f"[yellow]warning: {self._name} stops here: {error}[/yellow]\n"
                "Captures go on. `workbench view` makes it again where it is missing."
            )


def _counts(capture: ev.CaptureTaken) -> bool:
    """Whether a capture is one of those that the step announced; alternative captures come on top."""
    return capture.purpose == "calibration" or capture.laser_id == "all"
