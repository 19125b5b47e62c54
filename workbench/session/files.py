"""Atomic writing of files: a reader sees the old content or all of the new."""

from __future__ import annotations

import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path

from workbench.model.errors import BadInputError, StoppedError

RANDOM_BYTES = 4
"""Random part of the name of a temporary file."""


def write_output(path: Path, content: bytes) -> None:
    """Write a file that the user named; an existing file is replaced atomically.

    Links are followed: the file that a link points to is replaced.

    Raises:
        BadInputError: the folder is missing, cannot be written or is full, or `path` is no regular file.
    """
    check_output(path)
    try:
        write_atomically(path.resolve(), content)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from None


def check_output(path: Path) -> None:
    """Check before a computation that its result can be written.

    Raises:
        BadInputError: the folder is missing or cannot be written, or `path` is no regular file.
    """
    target = path.resolve()
    if not target.parent.is_dir():
        raise BadInputError(f"{path}: cannot be written: no such folder: {target.parent}")
    if target.exists() and not target.is_file():
        raise BadInputError(f"{path}: expected the name of a file to write, got something else")
    if not os.access(target.parent, os.W_OK):
        raise BadInputError(f"{path}: cannot be written: the folder {target.parent} does not allow it")


def write_record(path: Path, content: bytes) -> None:
    """Write a file of a session folder.

    Raises:
        StoppedError: the disk is full or cannot be written.
    """
    try:
        write_atomically(path, content)
    except OSError as error:
        raise StoppedError(f"{path}: cannot be written: {error.strerror or error}") from error


def write_atomically(path: Path, content: bytes) -> None:
    """Write `content` so that `path` contains the old bytes or all new ones, even after a power failure.

    An existing file keeps its mode.

    Raises:
        OSError: the file could not be written and `path` is unchanged, or its folder could not be synced.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(RANDOM_BYTES)}")
    # As any program creates a file: its mode follows from the umask.
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            with suppress(FileNotFoundError):
                os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode))
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def temporary_pattern(names: str) -> re.Pattern[str]:
    """Pattern of the temporary files of `write_atomically`, which a kill leaves.

    Args:
        names: pattern of the names of the files that were written.
    """
    return re.compile(rf"\.(?:{names})\.[0-9a-f]{{{2 * RANDOM_BYTES}}}")


def sync_folder(folder: Path) -> None:
    """Make renames in `folder` survive a power failure."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
