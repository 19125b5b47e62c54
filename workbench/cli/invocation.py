"""The command line, for the record."""

from __future__ import annotations

import shlex
import sys


def command_line() -> str:
    """The command in a form that a shell accepts."""
    return shlex.join(["workbench", *sys.argv[1:]])
