"""Operator, command line and time of an invocation, for the record."""

from __future__ import annotations

import getpass
import os
import shlex
import sys
import time


def operator() -> str:
    """Name of the user account; its number if it has no name."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def command_line() -> str:
    """Command line as text for a shell."""
    return shlex.join(["workbench", *sys.argv[1:]])


def now() -> str:
    """Local time with zone, ISO 8601."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z", time.localtime())
