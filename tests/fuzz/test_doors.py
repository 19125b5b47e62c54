"""A short run of the fuzzer: no input ends in a traceback, and no command in exit code 1."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.commands import COMMANDS
from tests.fuzz.doors import ROOT, Door, Outcome, counts, doors, fuzz, knock

INPUTS = 2000
SEED = 20


@pytest.mark.parametrize("door", doors(), ids=lambda door: door.name)
def test_mutated_inputs_are_read_or_refused(door: Door, tmp_path: Path) -> None:
    outcome = fuzz(door, tmp_path, counts(INPUTS)[door.name], SEED)
    assert outcome.found == {}
    assert outcome.refused > 0


def test_an_unexpected_error_is_found(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        raise KeyError(path.read_bytes()[0])

    outcome = Outcome()
    knock(Door("bad", "x", (b"a",), read, 1), tmp_path, b"a", outcome)
    assert list(outcome.found.values()) == [b"a"]
    assert outcome.total == outcome.failed == 1


def test_mutated_files_end_commands_with_a_code_for_the_user() -> None:
    """In a new process: one that has started threads cannot be forked."""
    script = f"from tests.fuzz.commands import fuzz_part; print(fuzz_part({len(COMMANDS)}, {SEED}).found)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout == "{}\n"
