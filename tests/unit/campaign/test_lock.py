"""Locks of a campaign's folder: one program, any number of workers."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workbench.campaign.lock import WRITERS, client_lock, no_writer, writer_lock
from workbench.model.errors import BadInputError

HOLD = """
import sys
from pathlib import Path
from workbench.campaign.lock import client_lock, writer_lock
with client_lock(Path(sys.argv[1])), writer_lock(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_killed_program_holds_no_lock(tmp_path: Path) -> None:
    (tmp_path / WRITERS).touch()
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(BadInputError, match="another program is running"), client_lock(tmp_path):
            pass
        with no_writer(tmp_path) as is_quiet:
            assert not is_quiet
        other.kill()
        other.wait()
    with client_lock(tmp_path), no_writer(tmp_path) as is_quiet:
        assert is_quiet


def test_workers_share_their_lock(tmp_path: Path) -> None:
    (tmp_path / WRITERS).touch()
    with writer_lock(tmp_path), writer_lock(tmp_path), no_writer(tmp_path) as is_quiet:
        assert not is_quiet


def test_errors_inside_the_lock_pass_unchanged(tmp_path: Path) -> None:
    (tmp_path / WRITERS).touch()
    with pytest.raises(FileNotFoundError), writer_lock(tmp_path):
        (tmp_path / "none").read_text()
