"""Who called, and with what: for the record."""

from __future__ import annotations

import getpass
import os
import shlex
import sys
import time


def operator() -> str:
    """Name of the account; its number where it has no name."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def command_line() -> str:
    """The command as it could be typed again."""
    return shlex.join(["workbench", *sys.argv[1:]])


def now() -> str:
    """Local time with its zone, ISO 8601."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z", time.localtime())
