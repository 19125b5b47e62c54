"""Locks of a campaign's folder: one program runs the campaign, and workers write into the folder.

Both are files that are locked while they are open, so that the kernel releases the lock of a program that is
killed. The handles are open for reading and writing: NFS refuses exclusive locks on a handle for reading.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from workbench.model.errors import BadInputError

CLIENT, WRITERS = ".campaign.lock", ".writers.lock"
"""Names of the files: of the program that runs the campaign, and of the workers."""


@contextmanager
def client_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of the program that runs the campaign; the folder need not have any other file.

    Raises:
        BadInputError: another program holds it.
        OSError: the file cannot be opened or locked.
    """
    with _locked(folder / CLIENT, os.O_CREAT, fcntl.LOCK_EX | fcntl.LOCK_NB) as is_held:
        if not is_held:
            raise BadInputError(f"{folder}: another program is running this campaign")
        yield


@contextmanager
def writer_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of a worker that writes into the folder; any number of workers hold it.

    Raises:
        BadInputError: this computer does not have the folder of the campaign.
        OSError: the file cannot be locked.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(_locked(folder / WRITERS, 0, fcntl.LOCK_SH))
        except FileNotFoundError:
            raise BadInputError(
                f"worker {os.uname().nodename}: expected the folder of the campaign, {folder}, found none;"
                " share it with all workers under this path"
            ) from None
        yield


@contextmanager
def no_writer(folder: Path) -> Iterator[bool]:
    """Whether no worker writes into the folder; none begins before the end of the context.

    Raises:
        OSError: the file cannot be opened or locked.
    """
    with _locked(folder / WRITERS, os.O_CREAT, fcntl.LOCK_EX | fcntl.LOCK_NB) as is_held:
        yield is_held


@contextmanager
def _locked(path: Path, flags: int, how: int) -> Iterator[bool]:
    """Lock a file; False if another program holds it, and `how` does not wait."""
    handle = os.open(path, os.O_RDWR | os.O_CLOEXEC | flags, 0o666)
    try:
        try:
            fcntl.flock(handle, how)
            is_held = True
        except BlockingIOError:
            is_held = False
        yield is_held
    finally:
        os.close(handle)
