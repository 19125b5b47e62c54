"""The end of the program."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from workbench.model.errors import StoppedError

hung = False
"""Whether a thread hangs in a library that would be waited for at the end."""
all_written = False
"""Whether all that the command leaves is on disk: to take down what was imported, module by module, then
gains nothing and is a twentieth of a short command's time."""


def leave(code: int) -> NoReturn:
    """End with an exit code, without waiting for what hangs or need not be waited for."""
    at_once = hung or all_written
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # nobody reads it any more, or its disk is full; Python's own end would try again
            at_once, code = True, code or StoppedError.exit_code
    if at_once:
        os._exit(code)
    sys.exit(code)
