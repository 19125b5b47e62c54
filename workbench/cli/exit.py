"""Termination of the program."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from typing import NoReturn

from workbench.cli.stopping import ignore_signals
from workbench.model.errors import StoppedError

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
