"""Manifest, records, calibration and hashes of one session, for its certificate."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from workbench.model import event as ev
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.session.journal import JOURNAL, last_chain, read_journal
from workbench.session.manifest import MANIFEST, Manifest, load_manifest, load_session_rig
from workbench.session.state import SessionStatus, effective, session_status

E = TypeVar("E")
NO_CHAIN = "this record has no hash chain (it was written by an earlier version): an edit cannot be detected"


@dataclass(frozen=True)
class OverruledWarning:
    """A failed check whose results a person kept."""

    time: datetime
    text: str
    """The question, with the failed check."""
    reason: str
    """Reason that the person stated; empty if none."""
    by: str
    in_effect: bool
    """Whether the results that were kept still count: no repair or repetition has replaced them."""


@dataclass(frozen=True)
class SessionRecord:
    """A session, read once."""

    folder: Path
    manifest: Manifest
    rig: Rig
    status: SessionStatus
    all_records: tuple[ev.Record, ...]
    """Records, void ones included."""

    @cached_property
    def records(self) -> tuple[ev.Record, ...]:
        """Records that are in effect."""
        return tuple(effective(self.all_records))

    def events(self, kind: type[E]) -> list[E]:
        """Events of one kind that are in effect, in order."""
        return [record.event for record in self.records if isinstance(record.event, kind)]

    def timed(self, kind: type[E]) -> Iterator[tuple[str, E]]:
        """Events of one kind with their time of day, void ones included."""
        for record in self.all_records:
            if isinstance(record.event, kind):
                yield utc(record.time_ns).strftime("%Y-%m-%d %H:%M:%S"), record.event

    @cached_property
    def overruled(self) -> tuple[OverruledWarning, ...]:
        """Warnings that a person overruled, in order of time; a repair does not remove them."""
        valid = {record.n for record in self.records}
        found: dict[tuple[str, str], OverruledWarning] = {}
        for record in self.all_records:
            one = record.event
            if not isinstance(one, ev.Answered) or not one.overrules:
                continue
            # A repair journals an answer that still holds once more: the first time counts.
            before = found.get((one.key, one.question))
            counts = record.n in valid or (before is not None and before.in_effect)
            time = utc(record.time_ns) if before is None else before.time
            reason = one.answer.reason or ""
            found[one.key, one.question] = OverruledWarning(time, one.question, reason, one.answer.by, counts)
        return tuple(found.values())

    @cached_property
    def fit(self) -> ev.FitFinished | None:
        """The last fit."""
        return next(reversed(self.events(ev.FitFinished)), None)

    @cached_property
    def calibration_path(self) -> Path | None:
        """File of the calibration that the session exported last, or of the existing one that it used.

        Raises:
            BadInputError: the file has changed since.
        """
        return recorded_calibration(self.folder, [record.event for record in self.records])

    @cached_property
    def calibration(self) -> Calibration | None:
        """The calibration of `calibration_path`.

        Raises:
            BadInputError: the file is missing or damaged, or has changed since the session.
        """
        return None if self.calibration_path is None else load_calibration(self.calibration_path)

    @cached_property
    def calibration_sha256(self) -> str:
        """Hash of the file of the calibration; empty if there is none."""
        path = self.calibration_path
        return "" if path is None or not path.exists() else file_sha256(path)

    @cached_property
    def is_own_calibration(self) -> bool:
        """Whether the session made its calibration."""
        return bool(self.events(ev.CalibrationExported))

    @property
    def unfinished_text(self) -> str:
        """Cause why the last step has no outcome."""
        word = "failed" if self.status.state == "failed" else "not finished"
        return f"{word}: {self.status.why or self.status.state}"

    @property
    def began(self) -> datetime | None:
        """Time of the first record, UTC."""
        return utc(self.all_records[0].time_ns) if self.all_records else None

    @property
    def ended(self) -> datetime | None:
        """Time of the last record, UTC."""
        return utc(self.all_records[-1].time_ns) if self.all_records else None

    @cached_property
    def journal_sha256(self) -> str:
        """Hash of the journal."""
        path = self.folder / JOURNAL
        return file_sha256(path) if path.exists() else ""

    @cached_property
    def journal_chain(self) -> str:
        """Hash at the end of the last record; empty in sessions of versions that did not record it."""
        return last_chain(self.folder) if self.all_records else ""

    @property
    def chain_remark(self) -> str:
        """Remark on a journal without a hash chain; empty with one, or without records."""
        return NO_CHAIN if self.all_records and not self.journal_chain else ""

    @cached_property
    def manifest_sha256(self) -> str:
        """Hash of the manifest."""
        return file_sha256(self.folder / MANIFEST)

    @cached_property
    def frames(self) -> tuple[ev.FrameRef, ...]:
        """Frames in effect, in order of the captures; positions that a table stated have none."""
        pairs = ((capture.on, capture.off) for capture in self.events(ev.CaptureTaken))
        return tuple(frame for pair in pairs for frame in pair if frame is not None and frame.path)

    @cached_property
    def frames_sha256(self) -> str:
        """Hash of the hashes of all frames in effect, in order of the captures."""
        digest = hashlib.sha256()
        for frame in self.frames:
            digest.update(f"{frame.path} {frame.sha256}\n".encode())
        return digest.hexdigest()

    @cached_property
    def missing_frames(self) -> int:
        """Number of frames in effect that are not in the folder.

        Raises:
            BadInputError: a frame has changed since it was taken.
        """
        missing = 0
        for frame in self.frames:
            path = self.folder / frame.path
            if not path.is_file():
                missing += 1
            elif file_sha256(path) != frame.sha256:
                raise BadInputError(
                    f"{path}: the frame has changed since it was taken (sha256 {frame.sha256[:12]}...);"
                    " restore it from a copy"
                )
        return missing


def read_session(folder: Path) -> SessionRecord:
    """Read a session.

    Raises:
        BadInputError: `folder` is no session folder, or its manifest or journal is damaged.
    """
    manifest, rig = load_manifest(folder), load_session_rig(folder)
    records = tuple(read_journal(folder)) if (folder / JOURNAL).exists() else ()
    return SessionRecord(folder, manifest, rig, session_status(folder), records)


def recorded_calibration(folder: Path, events: Iterable[object]) -> Path | None:
    """File of the calibration that a session exported last, or of the existing one that it used.

    Args:
        folder: folder of the session.
        events: events that are in effect, in order.

    Raises:
        BadInputError: the file has changed since.
    """
    kinds = ev.CalibrationExported | ev.CalibrationLoaded
    found = [event for event in events if isinstance(event, kinds)]
    return unchanged(folder / found[-1].path, found[-1].sha256) if found else None


def check_recorded(path: Path) -> None:
    """Compare a calibration file in a session's folder with the hash that the session recorded.

    Files elsewhere, and files that the session did not write, pass.

    Raises:
        BadInputError: the file has changed since, a repair of the session has replaced its result, or the
            journal is damaged.
    """
    path = path.resolve()
    if not (path.parent / MANIFEST).is_file() or not (path.parent / JOURNAL).exists():
        return
    records = list(read_journal(path.parent))
    written, valid = (
        [one.event for one in some if getattr(one.event, "path", None) == path.name]
        for some in (records, effective(records))
    )
    if written and not valid:
        raise BadInputError(
            f"{path}: the session was repaired since, and has another result; see `workbench sessions`"
        )
    recorded_calibration(path.parent, valid)


def unchanged(path: Path, sha256: str) -> Path:
    """The file of a calibration, which may be missing.

    Raises:
        BadInputError: the file has another hash than the session recorded.
    """
    if path.is_file() and (got := file_sha256(path)) != sha256:
        raise BadInputError(
            f"{path}: expected the calibration of the session (sha256 {sha256[:12]}...), got another"
            f" ({got[:12]}...): the file has changed; restore it from a copy, or make one again with"
            " `workbench fit SESSION -o FILE`"
        )
    return path


def utc(time_ns: int) -> datetime:
    """Time of a record."""
    return datetime.fromtimestamp(time_ns / 1e9, tz=UTC)


def text_sha256(text: str) -> str:
    """Hash of a text in UTF-8."""
    return hashlib.sha256(text.encode()).hexdigest()
