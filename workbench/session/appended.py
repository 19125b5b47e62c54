"""Files of one JSON object a line, to which programs append: opened under a lock, read line by line."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workbench.model.contents import read_file
from workbench.model.errors import BadInputError

LARGEST_BYTES = 2**26
LOCK_S = 10.0
"""Longest wait for another program that appends; it needs milliseconds."""
POLL_S = 0.05


@contextmanager
def locked(path: Path) -> Iterator[int]:
    """Handle of a file for reading and appending under a lock; the file is created where there is none.

    Raises:
        BadInputError: it is no regular file, cannot be written, or another program holds it.
    """
    if path.exists() and not path.is_file():
        raise BadInputError(f"{path}: expected a file, got something else; move it away")
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            _lock(handle, path)
            yield handle
        finally:
            os.close(handle)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from None


def append_line(handle: int, path: Path, line: str) -> None:
    """Append a line and sync; a last line without its end, as an editor may leave it, is ended first."""
    start = "" if path.read_bytes()[-1:] in {b"", b"\n"} else "\n"
    os.write(handle, f"{start}{line}\n".encode())
    os.fsync(handle)


def read_lines(path: Path, what: str) -> list[str]:
    """Lines of a file; other separators than the newline, which JSON may contain, do not end one.

    Raises:
        BadInputError: the file cannot be read, or is too large.
    """
    text = read_file(path, what, LARGEST_BYTES).decode(errors="replace")
    return text.removesuffix("\n").split("\n") if text else []


def _lock(handle: int, path: Path) -> None:
    deadline = time.monotonic() + LOCK_S
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise BadInputError(
                    f"{path}: another program has held it for {LOCK_S:g} s; end it, and run this again"
                ) from None
            time.sleep(POLL_S)
        else:
            return
