"""Standard streams: replacement of closed ones (`2>&-`), input in any encoding."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path


def fill_closed_streams() -> None:
    """Open the null device for each closed standard stream.

    Otherwise the next opened file would get its number, and output of a library could go into a journal.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115 - open to the end
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)


def accept_any_bytes() -> None:
    """Read bytes of standard input that are not UTF-8 as escapes in hexadecimal, which no answer expects.

    Otherwise a scanner or a terminal with another encoding would end the program.
    """
    if isinstance(sys.stdin, io.TextIOWrapper):
        sys.stdin.reconfigure(errors="backslashreplace")
