"""The end of the program."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from typing import NoReturn

from workbench.cli.stopping import ignore_signals
from workbench.model.errors import StoppedError

hung = False
"""Whether a thread hangs in a library that would be waited for at the end."""


def exit_program(code: int, at_once: bool = False) -> NoReturn:
    """End with an exit code; `at_once` without taking down, module by module, what was imported.

    That is a twentieth of a short command's time, and gains nothing where all that it leaves is on disk.
    """
    ignore_signals()  # the interpreter's own end would give them back their default, and end otherwise
    at_once = at_once or hung
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:  # its reader is gone, or its disk full; Python's own end would try again
            if code == 0 and error.errno != errno.EPIPE:
                with suppress(OSError):
                    print(f"error: what is printed cannot be written: {error.strerror}", file=sys.stderr)
            at_once, code = True, code or StoppedError.exit_code
    if at_once:
        os._exit(code)
    sys.exit(code)
