"""Server that runs pytest in forked processes, after one import of the large libraries.

    python -m tests.mutants.server < requests

Each line on standard input is a request in JSON: `arguments` of pytest, `environment`, `limit_s` (wall clock)
and `cpu_limit_s`. Each line on standard output is the answer: `code` of pytest, null after a timeout, and the
times `wall_s` and `cpu_s`. The server itself computes nothing: JAX and BLAS have no threads where it forks.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import select
import signal
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

LIBRARIES = (
    "cv2",
    "hypothesis",
    "jax.export",
    "jax.numpy",
    "matplotlib.figure",
    "numba",
    "optimistix",
    "pandas",
    "pydantic",
    "pytest",
    "rich.console",
    "ruamel.yaml",
    "scipy.integrate",
    "scipy.optimize",
    "scipy.stats",
    "typer",
)
"""Imported before the fork; none of them imports the workbench or starts a thread."""
SET_PDEATHSIG = 1
"""Option of prctl(2): the signal that the caller gets when its parent ends."""
SET_CHILD_SUBREAPER = 36
"""Option of prctl(2): orphans become children of the caller."""


def main() -> None:
    """Answer requests until the end of standard input."""
    prctl = ctypes.CDLL(None).prctl
    prctl(SET_PDEATHSIG, signal.SIGKILL)
    prctl(SET_CHILD_SUBREAPER, 1)
    for name in LIBRARIES:
        import_module(name)
    for line in sys.stdin:
        print(json.dumps(_answer(json.loads(line))), flush=True)


def _answer(request: dict[str, Any]) -> dict[str, float | None]:
    start = time.monotonic()
    pid = os.fork()
    if pid == 0:
        _run(request)
    ended = os.pidfd_open(pid)
    in_time = bool(select.select([ended], [], [], request["limit_s"])[0])
    os.close(ended)
    with contextlib.suppress(ProcessLookupError):  # it has not made its group yet
        os.killpg(pid, signal.SIGKILL)
    os.kill(pid, signal.SIGKILL)
    _, status, usage = os.wait4(pid, 0)
    _kill_orphans()
    code = os.waitstatus_to_exitcode(status)
    in_time = in_time and code != -signal.SIGXCPU
    return {
        "code": code if in_time else None,
        "wall_s": time.monotonic() - start,
        "cpu_s": usage.ru_utime + usage.ru_stime,
    }


def _run(request: dict[str, Any]) -> None:
    """Run pytest, in a process group of its own, and exit."""
    code = 1
    try:
        ctypes.CDLL(None).prctl(SET_PDEATHSIG, signal.SIGKILL)
        os.setpgid(0, 0)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nothing, stream)
        os.environ.update(request["environment"])
        limit_s = int(request["cpu_limit_s"])
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 1))
        import pytest

        code = int(pytest.main(request["arguments"]))
    finally:
        os._exit(code)


def _kill_orphans() -> None:
    """End the processes that a run has left, and those that they leave."""
    listed = Path(f"/proc/self/task/{os.getpid()}/children")
    while pids := listed.read_text().split():
        for pid in map(int, pids):
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


if __name__ == "__main__":
    main()
