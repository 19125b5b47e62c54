"""Journal of a session: one JSON record per line, only appended to."""

from __future__ import annotations

import errno
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from workbench.model.contents import printable_json, read_file
from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import Event, Record, SpotsFound
from workbench.model.problems import short
from workbench.session.chain import Chain, ChainBrokenError, split

JOURNAL = "journal.jsonl"
LARGEST_BYTES = 2**30
"""Largest journal; one of 10 000 captures has 30 MB."""


class Journal:
    """Writer of `journal.jsonl` in a session folder, one write per record.

    Each line carries the hash of the file up to there (`chain`). The file is locked while it is open, so that
    two programs never write one session.
    """

    def __init__(self, session_dir: Path, flags: int = os.O_CREAT | os.O_EXCL) -> None:
        self._path = session_dir / JOURNAL
        self._file = os.open(self._path, os.O_RDWR | os.O_APPEND | flags, 0o666)
        self._next = self._size = 0
        self._torn = False
        self._chain = Chain()
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._file)
            raise BadInputError(f"{session_dir}: another program is running this session") from None

    @classmethod
    def reopen(cls, session_dir: Path) -> tuple[Journal, tuple[Record, ...]]:
        """Open an existing journal, or create one that a kill prevented; returns it with its records.

        An incomplete record at the end, left by an interrupted write, is removed.

        Raises:
            BadInputError: another program writes the journal, or a record in it is damaged.
        """
        journal = cls(session_dir, os.O_CREAT)
        try:
            records = tuple(_records(journal._path, journal._chain))
            content = journal._path.read_bytes()
            journal._size = content.rfind(b"\n") + 1
            os.ftruncate(journal._file, journal._size)
        except BaseException:
            os.close(journal._file)
            raise
        journal._next = len(records)
        return journal, records

    def append(self, event: Event) -> Record:
        """Append one event. It is synced to disk, except for spots, which can be computed again.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        record = Record(n=self._next, time_ns=time.time_ns(), event=event)
        line = self._chain.sealed(record.model_dump_json().encode())
        if self._torn:
            raise StoppedError(f"{self._path}: the journal cannot be written after an earlier error")
        try:
            if os.write(self._file, line + b"\n") != len(line) + 1:
                raise OSError(errno.ENOSPC, "no space left on device")
            # Spots are computed again from the frames, and would cost thousands of syncs.
            if not isinstance(event, SpotsFound):
                os.fsync(self._file)
        except OSError as error:
            self._cut_back()
            raise StoppedError(f"{self._path}: the journal cannot be written: {error.strerror}") from error
        self._chain.add_own(line)
        self._next += 1
        self._size += len(line) + 1
        return record

    def _cut_back(self) -> None:
        """Remove the remains of a failed write, which would make later records unreadable."""
        try:
            os.ftruncate(self._file, self._size)
        except OSError:
            self._torn = True

    def close(self) -> None:
        """Sync and close."""
        os.fsync(self._file)
        os.close(self._file)

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_journal(session_dir: Path) -> Iterator[Record]:
    """Records of a session, in order.

    A last line without newline, left by a power failure, is dropped.

    Raises:
        BadInputError: there is no journal, or a line is damaged, edited, missing, repeated or exchanged;
            names file and line.
    """
    return _records(session_dir / JOURNAL, Chain())


def last_chain(session_dir: Path) -> str:
    """Hash at the end of the last complete line; empty without one, or of a version without hashes.

    Raises:
        BadInputError: there is no journal.
    """
    lines = _lines(session_dir / JOURNAL)
    return split(lines[-1])[1] if lines else ""


def _lines(path: Path) -> list[bytes]:
    """Complete lines."""
    whole, _, _ = read_file(path, "a session's journal", LARGEST_BYTES).rpartition(b"\n")
    return whole.split(b"\n") if whole else []


def _records(path: Path, chain: Chain) -> Iterator[Record]:
    """Records in order, each checked and added to `chain`."""
    for number, line in enumerate(_lines(path), start=1):
        try:
            record = Record.model_validate_json(printable_json(split(line)[0].decode("utf-8")))
        except ValueError:
            got = short(line.decode(errors="replace"))
            raise BadInputError(
                f"{path}:{number}: expected a journal record, got {got}; restore the journal from a copy"
            ) from None
        if record.n != number - 1:
            raise BadInputError(
                f"{path}:{number}: expected record {number - 1}, got {record.n}: lines are missing, repeated"
                " or exchanged; restore the journal from a copy"
            )
        try:
            chain.add(line)
        except ChainBrokenError as broken:
            raise BadInputError(
                f"{path}:{number}: expected the line as it was written, got an edited one, or one after an"
                f" edited one: {broken}; restore the journal from a copy"
            ) from None
        yield record


def is_running(session_dir: Path) -> bool:
    """Whether a program has the journal of the session open for writing."""
    try:
        handle = os.open(session_dir / JOURNAL, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False
