"""The journal: one JSON record a line, appended, never changed."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from pydantic import ValidationError

from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import Event, Record, SpotsFound

JOURNAL = "journal.jsonl"


class Journal:
    """Appends records to `journal.jsonl` of a session folder, one write a record."""

    def __init__(self, session_dir: Path) -> None:
        self._path = session_dir / JOURNAL
        self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        self._next = 0

    def append(self, event: Event) -> Record:
        """Write one event. It is synced to disk unless thousands of its kind come in a row.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        record = Record(n=self._next, time_ns=time.time_ns(), event=event)
        line = (record.model_dump_json() + "\n").encode()
        try:
            if os.write(self._file, line) != len(line):
                raise OSError(28, "no space left on device")
            # The spots are computed again from the frames; losing some costs nothing.
            if not isinstance(event, SpotsFound):
                os.fsync(self._file)
        except OSError as error:
            raise StoppedError(f"{self._path}: the journal cannot be written: {error.strerror}") from error
        self._next += 1
        return record

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
    """The records of a session, in order.

    A last line without its newline is what a power cut leaves, and is dropped.

    Raises:
        BadInputError: there is no journal, or a line in it is damaged (file and line are named).
    """
    path = session_dir / JOURNAL
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInputError(f"{path}: expected a session's journal: {error.strerror}") from None
    whole, _, _ = content.rpartition(b"\n")
    for number, line in enumerate(whole.split(b"\n") if whole else [], start=1):
        try:
            yield Record.model_validate_json(line)
        except ValidationError as error:
            what = error.errors()[0]["msg"]
            raise BadInputError(f"{path}:{number}: expected a journal record: {what}") from None
