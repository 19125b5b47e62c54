"""pytest plugin: write the functions of the workbench that the tests execute, as lines of a file.

    EXECUTED=/tmp/functions python -m pytest -n 0 -p tests.mutants.executed tests/unit/model/test_rig.py

Each line is the module and the first line of the function, separated by a colon.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from types import FrameType

ROOT = f"{Path(__file__).parents[2]}/"
SOURCES = f"{ROOT}workbench/"
_executed: set[str] = set()


def pytest_configure() -> None:
    """Begin recording, in all threads."""
    threading.settrace(_record)
    sys.settrace(_record)


def pytest_unconfigure() -> None:
    """Write the functions."""
    sys.settrace(None)
    Path(os.environ["EXECUTED"]).write_text("\n".join(sorted(_executed)))


def _record(frame: FrameType, event: str, argument: object) -> None:
    code = frame.f_code
    if code.co_filename.startswith(SOURCES):
        _executed.add(f"{code.co_filename.removeprefix(ROOT)}:{code.co_firstlineno}")
