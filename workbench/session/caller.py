"""Operator and time of a record."""

from __future__ import annotations

import getpass
import os
import time


def operator(named: str | None = None) -> str:
    """Name of a person as named, else of the account; its number if it has no name."""
    if named is not None:
        return named
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def now() -> str:
    """Local time with its zone, ISO 8601."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z", time.localtime())
