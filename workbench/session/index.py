"""Index of a folder of sessions in SQLite: their states and calibrations without reading every journal.

The file can be deleted at any time: it is made again from the sessions. Where it cannot be written, it is
made in memory.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticSerializationError

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.session.identity import identity_of
from workbench.session.journal import JOURNAL, is_running, read_journal
from workbench.session.manifest import MANIFEST, load_manifest
from workbench.session.state import SessionStatus, effective, session_status

INDEX = ".sessions.sqlite3"
FORMAT = 4
"""Number of the index's format; another one is made again."""
MOST_NAMED = 3
"""Largest number of copies that a remark names."""
BUSY_S = 2.5
"""Longest wait for another program that writes the index."""
IN_USE = {sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}
"""Codes of an index that another program uses: it is not damaged."""
Verdict = Literal["accepted", "exception", "refused", "none"]
VERDICTS: dict[Verdict, str] = {
    "accepted": "the last fit was accepted",
    "exception": "the last fit failed its limits and was accepted with a reason",
    "refused": "the last fit was refused",
    "none": "no fit",
}


@dataclass(frozen=True)
class IndexedSession:
    """One session of the index."""

    status: SessionStatus
    serial: str
    """Serial number of the rig; empty if the manifest is damaged."""
    began: str
    """Time of the manifest, ISO 8601; empty if it is damaged."""
    verdict: Verdict
    calibration: str = ""
    """File of the calibration that the session exported; empty if it made none."""
    calibration_sha256: str = ""
    """Hash of that file when it was exported."""
    verified: bool = False
    """Whether the session has readings of a trial."""
    identity: str = ""
    """Hash that copies of the session share; empty if it cannot be identified."""
    records: int = 0
    """Number of records of the journal, void ones included."""
    first_record_ns: int = 0
    """Time of the first record, ns since 1970 (UTC); 0 without records."""
    own_name: str = ""
    """Name of the folder in which the session began; empty if it is not known."""
    copies: tuple[str, ...] = ()
    """Names of other folders with the same session, which count as this one."""

    @property
    def name(self) -> str:
        """Name of the session's folder."""
        return self.status.session_dir.name


@dataclass(frozen=True)
class SessionSelection:
    """Sessions to list; None: all."""

    rig: str | None = None
    """Name or serial number of the rig."""
    since: date | None = None
    verdict: str | None = None
    """A key of `VERDICTS`."""
    until: date | None = None
    """Last day."""

    def includes(self, one: IndexedSession) -> bool:
        """Whether a session is selected."""
        day = one.began[:10]
        return (
            self.rig in {None, one.serial, one.status.rig}
            and (self.since is None or day >= self.since.isoformat())
            and (self.until is None or day <= self.until.isoformat())
            and self.verdict in {None, one.verdict}
        )


CONTENT = TypeAdapter(IndexedSession)
"""A row's content as JSON; reading checks it."""


def indexed_sessions(folder: Path) -> list[IndexedSession]:
    """Sessions of a folder, ordered by name and therefore by time; the index is brought up to date.

    Copies and links of one session are one entry: that with most records, a folder rather than a link, the
    one with the name that the session began with.

    Raises:
        BadInputError: there is no such folder.
    """
    if not folder.is_dir():
        got = "a file" if folder.exists() else "no such folder"
        raise BadInputError(f"{folder}: expected a folder of sessions, got {got}")
    stamps = {entry.name: stamp for entry, stamp in _stamps(folder)}
    return [_live(one) for one in _without_copies(_current(folder, stamps))]


def copies_text(sessions: Iterable[IndexedSession]) -> str:
    """Remark on copies of sessions in one line; empty without copies."""
    copied = [one for one in sessions if one.copies]
    if not copied:
        return ""
    pairs = [f"{copy} (of {one.name})" for one in copied for copy in one.copies]
    more = f" and {len(pairs) - MOST_NAMED} more" if len(pairs) > MOST_NAMED else ""
    are = "folder is a copy" if len(pairs) == 1 else "folders are copies"
    return f"{len(pairs)} {are} of another session and not counted: {', '.join(pairs[:MOST_NAMED])}{more}"


def _without_copies(sessions: Iterable[IndexedSession]) -> list[IndexedSession]:
    groups: dict[str, list[IndexedSession]] = {}
    for one in sessions:
        groups.setdefault(one.identity or one.name, []).append(one)
    return sorted((_merged(group) for group in groups.values()), key=lambda one: one.name)


def _merged(group: list[IndexedSession]) -> IndexedSession:
    """The session of a group of copies that counts, with the names of the others."""
    if len(group) == 1:
        return group[0]
    first, *others = sorted(group, key=_order_of_copies)
    return replace(first, copies=tuple(one.name for one in others))


def _order_of_copies(one: IndexedSession) -> tuple[int, bool, bool, str]:
    return -one.records, one.status.session_dir.is_symlink(), one.name != one.own_name, one.name


def _current(folder: Path, stamps: dict[str, str]) -> list[IndexedSession]:
    """Sessions of the index; a damaged file is deleted and made again once, then it is made in memory."""
    path = folder / INDEX
    for name in (str(path), str(path), ":memory:"):
        try:
            with closing(sqlite3.connect(name, timeout=BUSY_S)) as database:
                return _updated(database, folder, stamps)
        except (sqlite3.Error, ValidationError) as error:
            if getattr(error, "sqlite_errorcode", None) not in IN_USE:
                with suppress(OSError):  # no permission, or a folder in its place
                    path.unlink()
    raise BadInputError(f"{path}: the index cannot be made")


def _updated(database: sqlite3.Connection, folder: Path, stamps: dict[str, str]) -> list[IndexedSession]:
    _prepare(database)
    known: dict[str, tuple[str, str]] = {
        name: (stamp, content)
        for name, stamp, content in database.execute("SELECT name, stamp, content FROM sessions")
    }
    changed = [name for name, stamp in stamps.items() if known.get(name, ("", ""))[0] != stamp]
    kept = stamps.keys() - changed
    sessions = {name: _parsed(folder / name, known[name][1]) for name in kept}
    fresh = {name: read_indexed(folder / name) for name in changed}
    texts = {name: text for name, session in fresh.items() if (text := _text(session)) is not None}
    _store(database, texts, stamps, set(known) - set(stamps))
    return [one for _, one in sorted((sessions | fresh).items())]


def _stamps(folder: Path) -> Iterator[tuple[os.DirEntry[str], str]]:
    """Folders of sessions with the sizes and times of manifest and journal."""
    with os.scandir(folder) as entries:
        for entry in entries:
            manifest = _stamp(f"{entry.path}/{MANIFEST}")
            if manifest:
                yield entry, f"{manifest} {_stamp(f'{entry.path}/{JOURNAL}')}"


def _stamp(path: str) -> str:
    try:
        found = os.stat(path)  # noqa: PTH116 - a Path for each of thousands takes longer than the call
    except OSError:
        return ""
    return f"{found.st_mtime_ns} {found.st_size}"


def _prepare(database: sqlite3.Connection) -> None:
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if version != FORMAT:
        database.execute("DROP TABLE IF EXISTS sessions")
    database.execute("CREATE TABLE IF NOT EXISTS sessions (name TEXT PRIMARY KEY, stamp TEXT, content TEXT)")
    database.execute(f"PRAGMA user_version = {FORMAT}")
    database.commit()


def _store(
    database: sqlite3.Connection, fresh: dict[str, str], stamps: dict[str, str], gone: set[str]
) -> None:
    """Write changed sessions and remove those that are gone; a failure leaves the index as it is."""
    if not (fresh or gone):
        return
    try:
        with database:
            database.executemany(
                "INSERT OR REPLACE INTO sessions VALUES (?, ?, ?)",
                [(name, stamps[name], content) for name, content in fresh.items()],
            )
            database.executemany("DELETE FROM sessions WHERE name = ?", [(name,) for name in gone])
    except sqlite3.OperationalError:  # a full disk, or another program: the next command tries again
        return


def read_indexed(folder: Path) -> IndexedSession:
    """A session, from its files; one that is damaged has the error in its status."""
    status = session_status(folder)
    serial = began = ""
    try:
        manifest = load_manifest(folder)
        serial, began = manifest.rig.serial, manifest.created
        records = list(read_journal(folder)) if (folder / JOURNAL).exists() else []
    except BadInputError as error:
        status = replace(status, state="damaged", why=str(error))
        records = []
    first = records[0].event if records else None
    return replace(
        _with_results(IndexedSession(status, serial, began, "none"), records),
        identity=identity_of(folder, began, serial) if serial else "",
        records=len(records),
        first_record_ns=records[0].time_ns if records else 0,
        own_name=first.session if isinstance(first, ev.SessionStarted) else "",
    )


def _with_results(session: IndexedSession, records: Iterable[ev.Record]) -> IndexedSession:
    """The session with the results of its records in effect: verdict, calibration, readings.

    An exported calibration is an exception only if it follows the refused fit: an earlier one is of an
    earlier fit.
    """
    verdict: Verdict = "none"
    exported: ev.CalibrationExported | None = None
    verified = False
    for record in effective(records):
        match record.event:
            case ev.FitFinished() as fit:
                verdict = fit.verdict
            case ev.CalibrationExported() as event:
                exported = event
                verdict = "exception" if verdict == "refused" else verdict
            case ev.ReadingTaken():
                verified = True
            case _:
                pass
    session = replace(session, verdict=verdict, verified=verified)
    return (
        session
        if exported is None
        else replace(session, calibration=exported.path, calibration_sha256=exported.sha256)
    )


def _text(session: IndexedSession) -> str | None:
    """Content of a row; None if a name in it is no Unicode: such a session is read each time."""
    status = replace(session.status, session_dir=Path())
    try:
        session.name.encode()
        return CONTENT.dump_json(replace(session, status=status)).decode()
    except (UnicodeEncodeError, PydanticSerializationError):
        return None


def _parsed(folder: Path, content: str) -> IndexedSession:
    session = CONTENT.validate_json(content)
    return replace(session, status=replace(session.status, session_dir=folder))


def _live(session: IndexedSession) -> IndexedSession:
    """The session with its present state: one without an end may be running, or no longer."""
    if session.status.state not in {"running", "interrupted"}:
        return session
    if is_running(session.status.session_dir):
        status = replace(session.status, state="running", why="running in another program")
    else:
        status = session_status(session.status.session_dir)
    return replace(session, status=status)
