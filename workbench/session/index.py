"""Index of a folder of sessions in SQLite: their states and calibrations without reading every journal.

The file can be deleted at any time: it is made again from the sessions. Where it cannot be written, it is
made in memory.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.session.journal import JOURNAL, is_running, read_journal
from workbench.session.manifest import MANIFEST, load_manifest
from workbench.session.state import SessionStatus, effective, session_status

INDEX = ".sessions.sqlite3"
FORMAT = 2
"""Number of the index's format; another one is made again."""
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

    @property
    def name(self) -> str:
        """Name of the session's folder."""
        return self.status.session_dir.name


CONTENT = TypeAdapter(IndexedSession)
"""A row's content as JSON; reading checks it."""


def indexed_sessions(folder: Path) -> list[IndexedSession]:
    """All sessions of a folder, ordered by name and therefore by time; the index is brought up to date.

    Raises:
        BadInputError: there is no such folder.
    """
    if not folder.is_dir():
        got = "a file" if folder.exists() else "no such folder"
        raise BadInputError(f"{folder}: expected a folder of sessions, got {got}")
    stamps = {entry.name: stamp for entry, stamp in _stamps(folder)}
    return [_live(one) for one in _current(folder, stamps)]


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
    texts = {name: _text(session) for name, session in fresh.items()}
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
    """A session, from its files."""
    status = session_status(folder)
    try:
        manifest = load_manifest(folder)
        serial, began = manifest.rig.serial, manifest.created
    except BadInputError:
        serial = began = ""
    if status.state == "damaged" or not (folder / JOURNAL).exists():
        return IndexedSession(status, serial, began, "none")
    events = [record.event for record in effective(read_journal(folder))]
    fits = [event for event in events if isinstance(event, ev.FitFinished)]
    exported = [event for event in events if isinstance(event, ev.CalibrationExported)]
    verdict: Verdict = fits[-1].verdict if fits else "none"
    if verdict == "refused" and exported:
        verdict = "exception"
    readings = any(isinstance(event, ev.ReadingTaken) for event in events)
    file, sha256 = (exported[-1].path, exported[-1].sha256) if exported else ("", "")
    return IndexedSession(status, serial, began, verdict, file, sha256, readings)


def _text(session: IndexedSession) -> str:
    status = replace(session.status, session_dir=Path())
    return CONTENT.dump_json(replace(session, status=status)).decode()


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
