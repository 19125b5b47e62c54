"""The end of the program."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import NoReturn

hung = False
"""Whether a thread hangs in a library that would be waited for at the end."""


def leave(code: int) -> NoReturn:
    """End with an exit code, without waiting for what hangs."""
    if hung:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):
                stream.flush()
        os._exit(code)
    sys.exit(code)
