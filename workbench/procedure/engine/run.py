"""Execution of procedures in one session on one bench."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from workbench.devices.protocols import Bench, Operator
from workbench.devices.registry import open_bench
from workbench.model import event as ev
from workbench.model.calibration import Provenance
from workbench.model.errors import BadInputError, StoppedError, WorkbenchError
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.operator import NoOperator, operator_of_bench
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.session.journal import Journal
from workbench.session.manifest import create_session, workbench_version

NO_OPERATOR = NoOperator("the caller has provided no operator")


@dataclass(frozen=True)
class Invocation:
    """Invocation of a session: operator, command, and time (ISO 8601 with zone)."""

    operator: str
    command: str
    created: str


def run(
    plan: Plan,
    session_dir: Path,
    consumers: Sequence[ev.Consumer],
    caller: Invocation,
    stopping: Callable[[], str | None],
    operator: Operator = NO_OPERATOR,
) -> None:
    """Run every procedure of the plan, in order, in one new session.

    An error is journalled as the end of the session before it is raised. Frames and records up to then are on
    disk, and `resume` continues from them.

    Args:
        plan: rig and procedures.
        session_dir: folder of the new session; must not exist.
        consumers: receivers of every record.
        caller: invocation, for the record.
        stopping: called between captures; a text is the reason to end the session.
        operator: operator, unless the bench has its own.

    Raises:
        WorkbenchError: the session ended early; the exit code identifies the cause.
    """
    try:
        session_dir.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"{session_dir.parent}: the folder of sessions cannot be created: {error.strerror}"
        ) from None
    with ExitStack() as stack:
        # The bench first: a failure to open it must not leave an empty session.
        bench = stack.enter_context(open_bench(plan.rig, session_dir))
        create_session(
            session_dir,
            plan.rig,
            plan.rig_path,
            plan.procedure_paths,
            operator=caller.operator,
            created=caller.created,
            command=caller.command,
            calibration=None if plan.calibration is None else plan.calibration.entry,
            procedure_model=Procedure,
        )
        if plan.calibration is not None:
            plan.calibration.write_copy(session_dir)
        journal = stack.enter_context(Journal(session_dir))
        recorder = ReplayingJournal(journal, consumers)
        run_steps(plan, open_context(plan, session_dir, bench, operator, recorder, caller, stopping))


def run_steps(plan: Plan, context: Context) -> None:
    """Run every step and journal the end of the session, also after an error."""
    try:
        _run_all(plan, context)
    except BaseException as error:
        # An unwritable journal must not hide the cause of the end.
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
    """Context for the steps of a session, with `caller` as provenance."""
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
    existing = plan.calibration
    return Context(
        session_dir,
        plan.rig,
        bench,
        operator_of_bench(bench, operator),
        recorder,
        provenance,
        stopping,
        calibration=None if existing is None else existing.calibration,
    )


def _ending(error: BaseException) -> ev.SessionFinished:
    if isinstance(error, WorkbenchError):
        return ev.SessionFinished(exit_code=error.exit_code, message=str(error))
    return ev.SessionFinished(exit_code=1, message=f"internal error: {error!r}")


def _run_all(plan: Plan, context: Context) -> None:
    names = tuple(p.procedure for p in plan.procedures)
    context.emit(ev.SessionStarted(session=context.session_dir.name, rig=plan.rig.rig, procedures=names))
    if plan.calibration is not None:
        context.emit(plan.calibration.loaded(context.provenance.created))
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
                    shots=step.captures(plan.rig),
                )
            )
            context.steps, context.step_index = procedure.steps, index - 1
            outcome = step.run(context, procedure.step_name(index))
            context.emit(ev.StepFinished(procedure=procedure.procedure, index=index, outcome=outcome))
