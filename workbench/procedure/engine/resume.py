"""Going on with a session that ended early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TypeVar

from workbench.devices.protocols import Operator
from workbench.devices.registry import open_bench
from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel, load_yaml_model, parse_yaml_model
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.procedure.engine.run import NOBODY, Invocation, go_through, open_context
from workbench.session.journal import JOURNAL, Journal, read_journal
from workbench.session.manifest import (
    MANIFEST,
    FileEntry,
    Manifest,
    load_manifest,
    recorded_versions,
    replace_manifest,
)


def resume(
    session_dir: Path,
    consumers: Sequence[ev.Consumer],
    caller: Invocation,
    stopping: Callable[[], str | None],
    operator: Operator = NOBODY,
    accepted_because: str | None = None,
) -> None:
    """Run the session's procedures again from their start, on the frames that are on disk already.

    Placements that are whole are not captured again; the one that was under way is, from its placing on.
    What is computed is computed again from the frames.

    Args:
        session_dir: the session.
        consumers: who is shown every record, those of before first.
        caller: who resumes it, for the record.
        stopping: asked between shots; a text ends the session with it.
        operator: who answers, unless the bench has somebody of its own.
        accepted_because: why to go on although rig, procedure or versions have changed.

    Raises:
        BadInputError: this is no session, it is finished or running, or something has changed.
        WorkbenchError: as `run`.
    """
    began_with = load_manifest(session_dir)
    _check_unfinished(session_dir)
    now, changes = files_now(session_dir, began_with)
    if changes and accepted_because is None:
        raise BadInputError(
            "\n".join(f"{session_dir}: {change}" for change in changes)
            + '\nput it back as it was, or go on with --accept-changes "why it does no harm"'
        )
    plan = plan_of(session_dir, now)
    with ExitStack() as stack:
        journal, before = Journal.reopen(session_dir)
        stack.enter_context(journal)
        bench = stack.enter_context(open_bench(plan.rig, session_dir))
        if changes:
            replace_manifest(session_dir, began_with, now.rig, now.procedures)
        resumed = ev.SessionResumed(
            from_n=0,
            operator=caller.operator,
            command=caller.command,
            created=caller.created,
            changes=changes,
            accepted_because=accepted_because if changes else None,
        )
        recorder = ReplayingJournal(journal, consumers, before, resumed)
        began = Invocation(began_with.operator, began_with.command, began_with.created)
        go_through(plan, open_context(plan, session_dir, bench, operator, recorder, began, stopping))


def files_now(session_dir: Path, began_with: Manifest) -> tuple[Manifest, tuple[str, ...]]:
    """The session's files as they are now, and what has changed since it began.

    A file that is gone is taken from the session; a comment that changed is no change.
    """
    rig, rig_change = _now(session_dir, began_with.rig, Rig)
    procedures = [_now(session_dir, entry, Procedure) for entry in began_with.procedures]
    versions = recorded_versions()
    moved = [
        f"{name} was {was} when the session began and is {versions.get(name)}"
        for name, was in began_with.versions.items()
        if versions.get(name) != was
    ]
    now = began_with.model_copy(update={"rig": rig, "procedures": tuple(entry for entry, _ in procedures)})
    return now, (*rig_change, *(change for _, changes in procedures for change in changes), *moved)


def plan_of(session_dir: Path, manifest: Manifest) -> Plan:
    """The plan that a manifest's texts make."""
    where = session_dir / MANIFEST
    procedures = [
        parse_yaml_model(entry.text, Path(f"{where} ({entry.file})"), Procedure)
        for entry in manifest.procedures
    ]
    rig = parse_yaml_model(manifest.rig.text, Path(f"{where} (rig)"), Rig)
    paths = [Path(entry.file) for entry in manifest.procedures]
    return Plan.of(rig, Path(manifest.rig.file), procedures, paths)


Entry = TypeVar("Entry", bound=FileEntry)


def _now(session_dir: Path, entry: Entry, model: type[FileModel]) -> tuple[Entry, list[str]]:
    path = Path(entry.file)
    if not path.is_file():
        return entry, []
    now = load_yaml_model(path, model)
    if now == parse_yaml_model(entry.text, session_dir / MANIFEST, model):
        return entry, []
    change = f"{path} has changed since the session began"
    return entry.model_copy(update={"text": path.read_text(encoding="utf-8")}), [change]


def _check_unfinished(session_dir: Path) -> None:
    records = list(read_journal(session_dir)) if (session_dir / JOURNAL).exists() else []
    first, last = (records[0].event, records[-1].event) if records else (None, None)
    if isinstance(first, ev.SessionStarted) and first.session != session_dir.name:
        raise BadInputError(
            f"{session_dir}: expected the session's folder to be called {first.session}, as when it began;"
            " give it its name back"
        )
    if isinstance(last, ev.SessionFinished) and last.exit_code == 0:
        raise BadInputError(f"{session_dir}: the session is finished, there is nothing to resume")
