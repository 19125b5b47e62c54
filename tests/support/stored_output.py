"""Outputs of heavy commands in docs/benchmarks; tables of the documentation are made from the newest ones.

The first line states the subject, the day, the command, and the commit of the code that ran.
"""

from __future__ import annotations

import datetime as dt
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "benchmarks"
CODE = ("workbench", "tests", "procedures", "rigs")
FIRST_LINE = re.compile(r".+, \d{4}-\d\d-\d\d: `(?P<command>[^`]+)`, code (?P<code>\w+\+?)")


@dataclass(frozen=True)
class StoredOutput:
    """Output of one command."""

    path: Path
    command: str
    code: str
    """Commit of the code; with `+` if files had changed since."""
    lines: tuple[str, ...]
    """Without the first line."""

    def section(self, heading: str) -> tuple[str, ...]:
        """Lines after the one that begins with `heading`, up to the next empty line.

        Raises:
            LookupError: no line begins so.
        """
        for n, line in enumerate(self.lines):
            if line.startswith(heading):
                rest = self.lines[n + 1 :]
                return rest[: rest.index("")] if "" in rest else rest
        raise LookupError(f"{self.path.name}: no line begins with {heading!r}")


def store(subject: str, title: str, command: str, lines: Sequence[str]) -> None:
    """Print an output and write it to the day's file of its subject."""
    today = dt.datetime.now(tz=dt.UTC).date().isoformat()
    text = "\n".join([f"{title}, {today}: `{command}`, code {code_version()}", *lines])
    print(text)
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{today}-{subject}.txt").write_text(text + "\n")


def newest(subject: str) -> StoredOutput:
    """The newest output of a subject.

    Raises:
        LookupError: there is none, or its first line does not state command and code.
    """
    found = sorted(FOLDER.glob(f"????-??-??-{subject}.txt"))
    if not found:
        raise LookupError(f"{FOLDER}: no output of {subject}")
    first, *lines = found[-1].read_text().splitlines()
    stated = FIRST_LINE.match(first)
    if stated is None:
        raise LookupError(f"{found[-1].name}: the first line does not state day, command and code: {first}")
    return StoredOutput(found[-1], stated["command"], stated["code"], tuple(lines))


def code_version() -> str:
    """Commit of the working tree, with `+` if files have changed since; `unknown` outside a clone."""
    try:
        commit = _git("rev-parse", "--short", "HEAD")
        return f"{commit}+" if _git("status", "--porcelain", "--untracked-files=no", "--", *CODE) else commit
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
