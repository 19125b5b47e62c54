"""Resumption of a session that ended early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TypeVar

from workbench.devices.protocols import Operator
from workbench.devices.registry import open_bench
from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel, load_yaml_model, parse_yaml_model, standalone_text
from workbench.procedure.engine.existing_calibration import ExistingCalibration
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.repair import Repair, restored_frames
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.procedure.engine.run import NO_OPERATOR, Invocation, open_context, run_steps
from workbench.session.frames import FrameStore
from workbench.session.journal import JOURNAL, Journal, read_journal
from workbench.session.manifest import (
    MANIFEST,
    FileEntry,
    Manifest,
    load_manifest,
    recorded_versions,
    replace_manifest,
)


class ChangedFilesError(BadInputError):
    """Rig, procedures or versions have changed since the session began, and no reason accepts it."""

    def __init__(self, session_dir: Path, changes: Sequence[str]) -> None:
        self.session_dir = session_dir
        self.changes = tuple(f"{session_dir}: {change}" for change in changes)
        advice = 'undo the changes, or add --accept-changes "reason why they are harmless"'
        super().__init__("\n".join((*self.changes, advice)))


def resume(
    session_dir: Path,
    consumers: Sequence[ev.Consumer],
    caller: Invocation,
    stopping: Callable[[], str | None],
    operator: Operator = NO_OPERATOR,
    accepted_because: str | None = None,
    repair: Repair | None = None,
) -> None:
    """Replay the session's procedures from the start with the frames on disk, then continue them.

    Complete placements are not captured again; the one that was under way is placed and captured again. All
    results are computed again from the frames.

    Args:
        session_dir: session folder.
        consumers: receivers of every record, earlier ones first.
        caller: invocation, for the record.
        stopping: called between captures; a text is the reason to end the session.
        operator: operator, unless the bench has its own.
        accepted_because: reason to resume although rig, procedures or versions have changed.
        repair: decisions about placements, which are journalled first; a finished session can be repaired.

    Raises:
        ChangedFilesError: files or versions have changed.
        BadInputError: `session_dir` is no session; the session is finished or running. The repair names no
            placement of the session, or frames to restore are missing.
        WorkbenchError: see `run`.
    """
    began_with = load_manifest(session_dir)
    _check_unfinished(session_dir, finished_too=repair is not None)
    now, changes = files_now(session_dir, began_with)
    if changes and accepted_because is None:
        raise ChangedFilesError(session_dir, changes)
    plan = plan_of(session_dir, now)
    with ExitStack() as stack:
        journal, before = Journal.reopen(session_dir)
        stack.enter_context(journal)
        decided = None if repair is None else repair.decided(plan, before, caller)
        if decided is not None:
            _check_frames(session_dir, before, decided)
        bench = stack.enter_context(open_bench(plan.rig, session_dir))
        resumed = ev.SessionResumed(
            from_n=0,
            operator=caller.operator,
            command=caller.command,
            created=caller.created,
            changes=changes,
            accepted_because=accepted_because if changes else None,
        )
        if decided is not None:
            before = (*before, journal.append(decided))
        for key, frames in restored_frames(before).items():
            FrameStore(session_dir).bring_back(key, frames)
        accept = partial(replace_manifest, session_dir, began_with, now.rig, now.procedures)
        if changes and not before:  # nothing was recorded with the earlier files
            accept()
        recorder = ReplayingJournal(journal, consumers, before, resumed, accept if changes else None)
        began = Invocation(began_with.operator, began_with.command, began_with.created)
        run_steps(plan, open_context(plan, session_dir, bench, operator, recorder, began, stopping))


def _check_frames(session_dir: Path, records: Sequence[ev.Record], decided: ev.SessionRepaired) -> None:
    """Refuse a repair that restores captures whose frames are missing, before it is journalled."""
    repaired = ev.Record(n=len(records), time_ns=0, event=decided)
    for key, frames in restored_frames([*records, repaired]).items():
        FrameStore(session_dir).find_frames(key, frames)


def files_now(session_dir: Path, began_with: Manifest) -> tuple[Manifest, tuple[str, ...]]:
    """Present input files of a session, and descriptions of their changes since its start.

    A missing file is taken from the manifest. A changed comment is no change.
    """
    rig, rig_change = _now(session_dir, began_with.rig, Rig)
    procedures = [_now(session_dir, entry, Procedure) for entry in began_with.procedures]
    versions = recorded_versions()
    version_changes = [
        f"{name}: expected version {was} (at the session's start), got {versions.get(name)}"
        for name, was in began_with.versions.items()
        if versions.get(name) != was
    ]
    now = began_with.model_copy(update={"rig": rig, "procedures": tuple(entry for entry, _ in procedures)})
    return now, (*rig_change, *(change for _, changes in procedures for change in changes), *version_changes)


def plan_of(session_dir: Path, manifest: Manifest) -> Plan:
    """Plan from the texts in a manifest, and the copy of an existing calibration.

    Raises:
        BadInputError: see `Plan.of` and `ExistingCalibration.of_session`.
    """
    where = session_dir / MANIFEST
    procedures = [
        parse_yaml_model(entry.text, Path(f"{where} ({entry.file})"), Procedure)
        for entry in manifest.procedures
    ]
    rig = parse_yaml_model(manifest.rig.text, Path(f"{where} (rig)"), Rig)
    paths = [Path(entry.file) for entry in manifest.procedures]
    entry = manifest.calibration
    existing = None if entry is None else ExistingCalibration.of_session(session_dir, entry, rig)
    return Plan.of(rig, Path(manifest.rig.file), procedures, paths, existing)


Entry = TypeVar("Entry", bound=FileEntry)


def _now(session_dir: Path, entry: Entry, model: type[FileModel]) -> tuple[Entry, list[str]]:
    path = Path(entry.file)
    if not path.is_file():
        return entry, []
    now, before = load_yaml_model(path, model), parse_yaml_model(entry.text, session_dir / MANIFEST, model)
    if now == before:
        return entry, []
    where = first_change(before.model_dump(mode="json"), now.model_dump(mode="json"))
    change = f"{path} has changed since the session began, first at {where}"
    return entry.model_copy(update={"text": standalone_text(path, model)}), [change]


def first_change(before: object, now: object, key: str = "") -> str:
    """Key of the first value that differs, with both values: `camera.f_px.value (650.0, now 700.0)`.

    Args:
        before: values of the earlier file; mappings and lists may be nested.
        now: those of the present file, which differ.
        key: key of both in the file.
    """
    if isinstance(before, dict) and isinstance(now, dict):
        absent = "nothing"
        for name in dict.fromkeys([*before, *now]):
            one, other = before.get(name, absent), now.get(name, absent)
            if one != other:
                return first_change(one, other, f"{key}.{name}".lstrip("."))
    if isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        index = next(n for n, (one, other) in enumerate(zip(before, now, strict=True)) if one != other)
        return first_change(before[index], now[index], f"{key}[{index}]")
    return f"{key or 'document'} ({short(before)}, now {short(now)})"


def _check_unfinished(session_dir: Path, *, finished_too: bool) -> None:
    records = list(read_journal(session_dir)) if (session_dir / JOURNAL).exists() else []
    first, last = (records[0].event, records[-1].event) if records else (None, None)
    if isinstance(first, ev.SessionStarted) and first.session != session_dir.name:
        raise BadInputError(
            f"{session_dir}: expected the folder name {first.session}, as at the session's start; rename the"
            " folder"
        )
    if isinstance(last, ev.SessionFinished) and last.exit_code == 0 and not finished_too:
        raise BadInputError(
            f"{session_dir}: the session is finished and cannot be resumed; to capture a placement again or"
            " to leave one out, see workbench repair --help"
        )
