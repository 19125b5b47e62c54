"""Running procedures: one session, one bench, one recording."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from workbench.devices.protocols import Bench, Operator
from workbench.devices.registry import check_driver, load_bench_rig, open_bench
from workbench.model import event as ev
from workbench.model.calibration import Provenance
from workbench.model.errors import BadInputError, StoppedError, WorkbenchError
from workbench.model.procedure import CaptureGridStep, FitStep, Procedure, Step, load_procedure
from workbench.model.rig import Rig
from workbench.procedure.engine.context import Context, UpcomingFit
from workbench.procedure.engine.operator import NoOperator, operator_of_bench
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.procedure.steps import run_step, shots
from workbench.session.journal import Journal
from workbench.session.manifest import create_session, workbench_version

NOBODY = NoOperator("the caller has given nobody to ask")


@dataclass(frozen=True)
class Invocation:
    """Who runs a session, with what command, and when (ISO 8601 with zone)."""

    operator: str
    command: str
    created: str


@dataclass(frozen=True)
class Plan:
    """What is about to run, read and checked before anything is switched on."""

    rig: Rig
    rig_path: Path
    procedures: tuple[Procedure, ...]
    procedure_paths: tuple[Path, ...]

    @classmethod
    def load(cls, rig_path: Path, procedure_paths: Sequence[Path]) -> Plan:
        """Read the files.

        Raises:
            BadInputError: one of them is wrong.
        """
        procedures = tuple(load_procedure(path) for path in procedure_paths)
        return cls.of(load_bench_rig(rig_path), rig_path, procedures, procedure_paths)

    @classmethod
    def of(
        cls, rig: Rig, rig_path: Path, procedures: Sequence[Procedure], procedure_paths: Sequence[Path]
    ) -> Plan:
        """Check what was read.

        Raises:
            BadInputError: steps do not find what they need, two procedures have one name, no such driver.
        """
        names = [p.procedure for p in procedures]
        for path, name in zip(procedure_paths, names, strict=True):
            if names.count(name) > 1:
                raise BadInputError(
                    f"{path}: procedure: expected a name that no other procedure of this call has, got {name}"
                )
        _check_order(procedures, procedure_paths)
        check_driver(rig)
        return cls(rig, rig_path, tuple(procedures), tuple(procedure_paths))

    def new_session(self, sessions: Path) -> Path:
        """A folder name that sorts by time and says what was run; with a number where it is taken."""
        stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime())
        base = sessions / f"{stamp}-{self.procedures[0].procedure}"
        taken = (base.with_name(f"{base.name}-{n}") for n in range(2, 1000))
        return base if not base.exists() else next(path for path in taken if not path.exists())


def _check_order(procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
    """Every step finds what it needs made by an earlier one, of its own or an earlier procedure."""
    made: set[str] = set()
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps):
            needs: str | None = getattr(step, "needs", None)
            if needs is not None and needs not in made:
                raise BadInputError(
                    f"{path}: steps[{index}]: {step.step} needs a step before it that gives {needs};"
                    " add one, or give a procedure that has one before this in the same call"
                )
            made.add(getattr(step, "gives", ""))


def run(
    plan: Plan,
    session_dir: Path,
    consumers: Sequence[ev.Consumer],
    caller: Invocation,
    stopping: Callable[[], str | None],
    operator: Operator = NOBODY,
) -> None:
    """Run every procedure of the plan, in order, in one new session.

    Whatever ends the session early is journalled as its end before it goes on to the caller; frames and
    records up to there are on disk, and `resume` goes on from them.

    Args:
        plan: what to run.
        session_dir: where to keep it; must not exist.
        consumers: who is shown every record.
        caller: for the record.
        stopping: asked between shots; a text ends the session with it.
        operator: who answers, unless the bench has somebody of its own.

    Raises:
        WorkbenchError: its exit code says what went wrong.
    """
    try:
        session_dir.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"{session_dir.parent}: expected a folder for sessions, which cannot be made: {error.strerror}"
        ) from None
    with ExitStack() as stack:
        # The bench first: one that does not open leaves no empty session behind.
        bench = stack.enter_context(open_bench(plan.rig, session_dir))
        create_session(
            session_dir,
            plan.rig,
            plan.rig_path,
            plan.procedure_paths,
            operator=caller.operator,
            created=caller.created,
            command=caller.command,
        )
        journal = stack.enter_context(Journal(session_dir))
        recorder = ReplayingJournal(journal, consumers)
        go_through(plan, open_context(plan, session_dir, bench, operator, recorder, caller, stopping))


def go_through(plan: Plan, context: Context) -> None:
    """Run every step, and journal how it ended."""
    try:
        _run_all(plan, context)
    except BaseException as error:
        # A journal that cannot be written any more must not hide why the session ended.
        with suppress(StoppedError):
            context.emit(_ending(error))
        raise
    context.emit(ev.SessionFinished(exit_code=0, message="done"))


def open_context(
    plan: Plan,
    session_dir: Path,
    bench: Bench,
    operator: Operator,
    recorder: ReplayingJournal,
    caller: Invocation,
    stopping: Callable[[], str | None],
) -> Context:
    """The context that a session's steps run in; what they write names `caller`."""
    provenance = Provenance(
        session=session_dir.name,
        captures_sha256="",
        rig=plan.rig.rig,
        serial=plan.rig.serial,
        command=caller.command,
        version=workbench_version(),
        operator=caller.operator,
        created=caller.created,
    )
    return Context(
        session_dir, plan.rig, bench, operator_of_bench(bench, operator), recorder, provenance, stopping
    )


def _ahead(steps: Sequence[Step], index: int) -> UpcomingFit | None:
    """The next fit from a step on, and what is planned before it."""
    for number, fit in enumerate(steps[index:], start=index):
        if isinstance(fit, FitStep):
            before = [step for step in steps[:number] if isinstance(step, CaptureGridStep)]
            planned = tuple(standoff for step in before for standoff in step.standoffs_mm)
            return UpcomingFit(planned, fit.limits.max_relative_range_sd)
    return None


def _ending(error: BaseException) -> ev.SessionFinished:
    if isinstance(error, WorkbenchError):
        return ev.SessionFinished(exit_code=error.exit_code, message=str(error))
    return ev.SessionFinished(exit_code=1, message=f"internal error: {error!r}")


def _run_all(plan: Plan, context: Context) -> None:
    names = tuple(p.procedure for p in plan.procedures)
    context.emit(ev.SessionStarted(session=context.session_dir.name, rig=plan.rig.rig, procedures=names))
    for procedure in plan.procedures:
        context.emit(
            ev.ProcedureStarted(
                procedure=procedure.procedure, title=procedure.title, steps=len(procedure.steps)
            )
        )
        for index, step in enumerate(procedure.steps, start=1):
            context.emit(
                ev.StepStarted(
                    procedure=procedure.procedure,
                    index=index,
                    step=step.step,
                    title=step.title,
                    shots=shots(step, plan.rig),
                )
            )
            context.ahead = _ahead(procedure.steps, index - 1)
            outcome = run_step(step, context, f"{procedure.procedure}.{index}")
            context.emit(ev.StepFinished(procedure=procedure.procedure, index=index, outcome=outcome))
