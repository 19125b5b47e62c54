"""`workbench sessions` of a folder with 5000 sessions, from the start of the process to its end."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

from tests.benchmarks.cold import Took, seconds
from tests.support.verified_sensor import FIRST, write_verification

SESSIONS, RUNS = 5000, 7
ERRORS = [[0.001, 0.002], [0.001, -0.001]]
"""Relative errors of the readings of each session, one row for each distance."""


def lines() -> Iterator[str]:
    """The table, line by line."""
    command = [str(Path(sys.executable).with_name("workbench")), "sessions", "--sessions"]
    with tempfile.TemporaryDirectory() as name:
        for n in range(SESSIONS):
            write_verification(Path(name), FIRST + n * timedelta(hours=6), ERRORS)
        first = seconds([*command, name], os.environ)
        warm = _fastest([*command, name])
        as_json = _fastest([*command, name, "--json"])
    yield f"{SESSIONS} sessions listed by `workbench sessions`, start of the process to its end; seconds, the"
    yield f"fastest of {RUNS} runs. Target of the wall: below 1."
    yield f"{'':40}{'wall':>6}{'processor':>11}"
    yield f"{'with an index':40}{warm.wall:6.2f}{warm.processor:11.2f}"
    yield f"{'with an index, --json':40}{as_json.wall:6.2f}{as_json.processor:11.2f}"
    yield f"{'the first time, which makes the index':40}{first.wall:6.1f}{first.processor:11.1f}"


def _fastest(command: list[str]) -> Took:
    return Took(*map(min, zip(*(seconds(command, os.environ) for _ in range(RUNS)), strict=True)))


def main() -> int:
    """Print."""
    for line in lines():
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
