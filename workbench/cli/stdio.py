"""Standard input, output and error, where one of them was closed (`2>&-`)."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def fill_closed_streams() -> None:
    """Put the null device in the place of each.

    Else the next file opened gets its number, and what a library prints goes into a session's journal.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115 - open to the end
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)
