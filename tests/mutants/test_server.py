"""Forked runs of pytest: codes, time limits, processes that are left."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SERVER = "from tests.mutants import server; server.LIBRARIES = ('pytest',); server.main()"
TESTS = """
import os, subprocess, sys, time

def test_good():
    assert os.environ["NAME"] == "value"

def test_bad():
    raise ValueError

def test_no_end():
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, start_new_session=True)
    open("pid", "w").write(str(child.pid))
    while True:
        pass
"""


def test_a_run_passes_fails_or_does_not_end_and_leaves_no_process(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(TESTS)
    usual = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", f"--rootdir={tmp_path}"]
    requests = [
        {"arguments": [*usual, f"test_it.py::{name}"], "environment": {"NAME": "value"}}
        | {"limit_s": 600, "cpu_limit_s": 5}
        for name in ("test_good", "test_bad", "test_no_end")
    ]
    done = subprocess.run(
        [sys.executable, "-c", SERVER],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        input="".join(json.dumps(request) + "\n" for request in requests),
        capture_output=True,
        text=True,
        check=True,
    )
    assert [json.loads(line)["code"] for line in done.stdout.splitlines()] == [0, 1, None]
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)
