"""The command line in this process, and the installed command in a shell."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


def refused(outcome: Outcome, code: int, *words: object) -> None:
    assert outcome.code == code
    assert "Traceback" not in outcome.err
    flat = " ".join(outcome.err.split())
    for word in words:
        assert str(word) in flat


SCRIPT = Path(sys.executable).with_name("workbench")


def shell(line: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["sh", "-c", line], capture_output=True, text=True, timeout=60, check=False)
