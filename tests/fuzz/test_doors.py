"""A short run of the fuzzer: no input ends in a traceback, and no command in exit code 1."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from tests.fuzz.__main__ import main
from tests.fuzz.commands import COMMANDS
from tests.fuzz.doors import ROOT, Door, counts, doors, fuzz, knock
from tests.fuzz.outcome import Outcome

INPUTS = 2000
SEED = 20


@pytest.mark.parametrize("door", doors(), ids=lambda door: door.name)
def test_mutated_inputs_are_read_or_refused(door: Door, tmp_path: Path) -> None:
    outcome = fuzz(door, tmp_path, counts(INPUTS)[door.name], SEED)
    assert outcome.found == {}
    assert outcome.results["refused"] > 0


@pytest.mark.parametrize("door", doors(), ids=lambda door: door.name)
def test_every_good_input_can_be_edited(door: Door, tmp_path: Path) -> None:
    for example in door.seeds:
        outcome = fuzz(replace(door, seeds=(example,)), tmp_path, 10, SEED)
        assert outcome.run >= 10


def test_an_unexpected_error_is_found(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        raise KeyError(path.read_bytes()[0])

    outcome = Outcome()
    knock(Door("bad", "x", (b"a",), read, 1), tmp_path, b"a", outcome)
    assert list(outcome.found.values()) == [b"a"]
    assert outcome.run == outcome.results["failed"] == 1


def test_nothing_is_read_after_the_deadline(tmp_path: Path) -> None:
    door = doors()[0]
    outcome = fuzz(door, tmp_path, 100, SEED, end_s=time.monotonic())
    assert outcome.run == len(door.seeds)


def test_a_run_that_is_cut_short_fails_and_states_what_was_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["--inputs", "100", "--commands", "3", "--minutes", "0"]) == 1
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("commands"))
    assert line.split()[1:4] == ["0", "of", "3"]


def test_mutated_files_end_commands_with_a_code_for_the_user() -> None:
    """In a new process: one that has started threads cannot be forked."""
    script = f"from tests.fuzz.commands import fuzz_part; print(fuzz_part({len(COMMANDS)}, {SEED}).found)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout == "{}\n"
