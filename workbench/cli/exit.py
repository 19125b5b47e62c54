"""Termination of the program: message, exit code, last output."""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

import typer

from workbench.cli.console import print_message
from workbench.cli.stopping import BY_CTRL_C, ignore_signals
from workbench.cli.verdict import VerdictShownError
from workbench.model.contents import printable
from workbench.model.errors import LaserOffNotConfirmedError, StoppedError, WorkbenchError

INTERNAL_ERROR = 1
WRITE_FAILURES = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}
"""Errors of a full disk, an exceeded quota or file size, a failed device, and a read-only file system."""
ACCESS_FAILURES = {errno.EACCES, errno.EPERM, errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EISDIR}
"""Errors of a missing permission, and of names that lead nowhere."""
hung = False
"""Whether a thread hangs in a library, or may, for which the interpreter would wait at the end."""


def exit_program(code: int, at_once: bool = False) -> NoReturn:
    """End the program.

    Args:
        code: exit code.
        at_once: skip the interpreter's clean-up, which takes a twentieth of a short command's time. All
            output must be on disk.
    """
    ignore_signals()  # the interpreter's clean-up would restore the default handlers
    at_once = at_once or hung
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:  # closed pipe or full disk; the interpreter's clean-up would try again
            if code == 0 and error.errno != errno.EPIPE:
                with suppress(OSError):
                    print(f"error: the output cannot be written: {error.strerror}", file=sys.stderr)
            at_once, code = True, code or StoppedError.exit_code
    if at_once:
        os._exit(code)
    sys.exit(code)


def report(error: BaseException) -> int:
    """Print the cause of the end of a command; returns its exit code."""
    chain = _chain(error)
    # An unconfirmed laser-off comes first, even if a later error (a stop, a full disk) covers it.
    if unsafe := [e for e in chain if isinstance(e, LaserOffNotConfirmedError)]:
        print_message(f"error: {unsafe[0]}", red=True)
        _print_notes(chain)
        return LaserOffNotConfirmedError.exit_code
    if isinstance(error, SystemExit):
        if any(isinstance(e, BrokenPipeError) for e in chain):  # as with `| head`; typer turns it into 1
            return StoppedError.exit_code
        return error.code if isinstance(error.code, int) else int(error.code is not None)
    if isinstance(error, VerdictShownError):
        return error.exit_code
    if isinstance(error, WorkbenchError):
        by_ctrl_c = isinstance(error, StoppedError) and str(error) == BY_CTRL_C
        print_message("stopped by Ctrl-C" if by_ctrl_c else f"error: {error}")
        _print_notes([error])
        return error.exit_code
    if isinstance(error, OSError) and error.errno in WRITE_FAILURES | ACCESS_FAILURES:
        use = "written" if error.errno in WRITE_FAILURES else "used"
        print_message(f"error: {error.filename or 'output'}: cannot be {use}: {error.strerror}")
        return StoppedError.exit_code
    with suppress(OSError):
        traceback.print_exception(error)
    print_message("internal error: this is a defect of the workbench; report it with the lines above")
    return INTERNAL_ERROR


def _print_notes(errors: Sequence[BaseException]) -> None:
    """Print the notes of errors, each once and unwrapped: they may be commands."""
    notes = dict.fromkeys(note for error in errors for note in getattr(error, "__notes__", ()))
    with suppress(OSError):  # a closed terminal
        for note in notes:
            typer.echo(printable(note), err=True)


def _chain(error: BaseException) -> list[BaseException]:
    """The error with all its causes and contexts."""
    found: list[BaseException] = []
    remaining: list[BaseException | None] = [error]
    while remaining:
        each = remaining.pop()
        if each is not None and each not in found:
            found.append(each)
            remaining += [each.__context__, each.__cause__]
    return found
